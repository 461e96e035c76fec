list(APPEND LAMINA_FRONTEND_SOURCES
  segments/scan_points.cpp segments/range_noise.cpp segments/range_check.cpp segments/line_fit.cpp segments/arc_fit.cpp segments/segment_options.cpp segments/segment_doubt.cpp segments/segment_curves.cpp
  segments/segment_extractor.cpp
  segments/assignment.cpp segments/plane_filter.cpp segments/segment_match.cpp segments/segment_tracker.cpp
  segments/segment_frontend.cpp segments/ground_lines.cpp segments/ground_returns.cpp segments/ground_lean.cpp segments/shared_walls.cpp)
