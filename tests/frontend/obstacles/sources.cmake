# A program of its own, as the floor's.
lamina_add_test(obstacles LINK lamina::frontend SOURCES
  obstacles/obstacle_scan_test.cpp obstacles/scan_view_test.cpp obstacles/walk_ends_test.cpp
  obstacles/pace_test.cpp obstacles/rim_growth_test.cpp obstacles/depth_looker_test.cpp)
