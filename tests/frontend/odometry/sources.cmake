# Tests of motion from scans and depth images.
list(APPEND LAMINA_FRONTEND_TESTS
  odometry/line_matcher_test.cpp odometry/likelihood_grid_test.cpp odometry/scan_odometry_test.cpp odometry/scan_outliers_test.cpp
  odometry/planar_pose_graph_test.cpp odometry/loop_closer_test.cpp odometry/submap_pair_test.cpp odometry/sweep_test.cpp odometry/sweep_finder_test.cpp
  odometry/depth_odometry_test.cpp odometry/depth_odometry_guess_test.cpp odometry/matched_pieces_test.cpp odometry/mounting_error_test.cpp odometry/clock_offset_test.cpp odometry/turn_claims_test.cpp odometry/wheel_doubt_test.cpp
  odometry/hidden_scan_test.cpp odometry/seen_through_test.cpp odometry/scanner_check_test.cpp)
