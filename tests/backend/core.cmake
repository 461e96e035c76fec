list(APPEND LAMINA_TEST_SOURCES graph_test.cpp plane_graph_test.cpp manifolds_test.cpp factors_test.cpp plane_factors_test.cpp
     refiner_test.cpp refiner_outliers_test.cpp turning_start_test.cpp loop_hearing_test.cpp merge_hearing_test.cpp problem_builder_test.cpp)
