list(APPEND LAMINA_BACKEND_SOURCES graph.cpp graph_problems.cpp plane_graph.cpp)
