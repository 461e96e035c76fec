# A program of its own: it is the largest room and is worked on alone.
lamina_add_test(floor LINK lamina::frontend SOURCES
  floor/blocks_test.cpp floor/pixel_labels_test.cpp floor/quarter_labels_test.cpp floor/labels_about_test.cpp floor/lanes_test.cpp floor/pixel_columns_test.cpp floor/sections_test.cpp floor/knock_watch_test.cpp floor/noise_watch_test.cpp floor/mounting_check_test.cpp floor/mounting_test.cpp floor/tilted_start_test.cpp floor/frontend_test.cpp
  floor/depth_distortion_test.cpp floor/plane_angles_test.cpp floor/low_obstacles_test.cpp floor/ground_looker_test.cpp floor/cloud_test.cpp floor/plane_evidence_test.cpp)
