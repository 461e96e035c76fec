list(APPEND LAMINA_FRONTEND_SOURCES
  obstacles/depth_looker.cpp obstacles/document_methods.cpp obstacles/floor_walk.cpp obstacles/obstacle_scan.cpp
  obstacles/obstacle_scanner.cpp obstacles/positive_scan.cpp obstacles/scan_options.cpp
  obstacles/scan_view.cpp obstacles/rim_growth.cpp obstacles/walk_ends.cpp obstacles/walk_planes.cpp)
