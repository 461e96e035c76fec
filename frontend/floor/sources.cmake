list(APPEND LAMINA_FRONTEND_SOURCES
  floor/blocks.cpp floor/cloud_planes.cpp floor/depth_distortion.cpp floor/disparity_sums.cpp floor/distortion_estimator.cpp floor/dominant_floor.cpp
  floor/floor_frontend.cpp floor/floor_judge.cpp floor/floor_memory.cpp floor/floor_options.cpp floor/floor_result.cpp
  floor/floor_surface.cpp floor/ground_cells.cpp floor/ground_looker.cpp floor/knock_watch.cpp floor/leveling.cpp floor/low_obstacles.cpp
  floor/mounting_causes.cpp floor/mounting_check.cpp floor/mounting_floors.cpp floor/mounting_offset.cpp
  floor/mounting_tracker.cpp floor/noise_watch.cpp floor/optical_watch.cpp floor/outlines.cpp floor/pixel_labels.cpp floor/plane_angles.cpp
  floor/pixel_sums.cpp floor/plane_evidence.cpp floor/edge_evidence.cpp
  floor/plane_extractor.cpp floor/plane_merging.cpp floor/plane_regions.cpp floor/quarter_labels.cpp
  floor/recursive_ransac.cpp floor/sections.cpp floor/surfels.cpp floor/tilted_start.cpp)
