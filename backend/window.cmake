list(APPEND LAMINA_BACKEND_SOURCES marginalization.cpp window_system.cpp sliding_window.cpp
     sliding_window_marginalize.cpp window_plane_graph.cpp)
