# Motion from scans and depth images, and places met again.
list(APPEND LAMINA_FRONTEND_SOURCES
  odometry/scan_points.cpp odometry/line_matcher.cpp odometry/likelihood_grid.cpp
  odometry/scan_odometry.cpp odometry/scan_odometry_wheels.cpp odometry/scanner_check.cpp odometry/scanner_changes.cpp odometry/left_to_wheels.cpp odometry/wheel_doubt.cpp odometry/seen_through.cpp odometry/matched_pieces.cpp odometry/mounting_error.cpp odometry/clock_offset.cpp odometry/turn_track.cpp odometry/turn_claims.cpp odometry/planar_pose_graph.cpp odometry/submap.cpp odometry/submap_pair.cpp odometry/submap_store.cpp
  odometry/loop_closer.cpp odometry/look_alikes.cpp odometry/moving_blocks.cpp odometry/place_watch.cpp odometry/block_matching.cpp odometry/sweep.cpp odometry/sweep_finder.cpp odometry/sweep_watch.cpp odometry/depth_blocks.cpp odometry/depth_odometry.cpp odometry/depth_odometry_search.cpp)
