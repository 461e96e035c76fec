list(APPEND LAMINA_FRONTEND_TESTS
  segments/arc_fit_test.cpp segments/segment_extractor_test.cpp segments/segment_tracker_test.cpp
  segments/range_noise_test.cpp segments/range_check_test.cpp
  segments/assignment_test.cpp segments/mounting_test.cpp segments/ground_test.cpp)
