list(APPEND LAMINA_FRONTEND_TESTS floor / blocks_test.cpp floor / sections_test.cpp floor /
     mounting_test.cpp floor / frontend_test.cpp floor / low_obstacles_test.cpp floor /
     cloud_test.cpp)
