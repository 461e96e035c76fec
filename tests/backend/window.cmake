list(APPEND LAMINA_TEST_SOURCES marginalization_test.cpp states_behind_test.cpp window_system_test.cpp
     sliding_window_test.cpp window_plane_graph_test.cpp association_test.cpp mapper_test.cpp mounting_doubt_test.cpp map_state_test.cpp
     mapper_merge_test.cpp degenerate_test.cpp frame_log_test.cpp surfel_evidence_test.cpp shared_planes_test.cpp
     loop_agreement_test.cpp online_upkeep_test.cpp wheel_errors_test.cpp depth_errors_test.cpp plane_evidence_test.cpp plane_views_test.cpp piece_gap_test.cpp crossing_planes_test.cpp ground_strokes_test.cpp plane_parts_test.cpp hidden_doubles_test.cpp plane_creases_test.cpp plane_ghosts_test.cpp level_gaps_test.cpp shifted_names_test.cpp waiting_doubles_test.cpp)
