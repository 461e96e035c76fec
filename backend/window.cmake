list(APPEND LAMINA_BACKEND_SOURCES marginalization.cpp states_behind.cpp window_system.cpp window_inverse.cpp sliding_window.cpp sliding_window_linearize.cpp sliding_window_solve.cpp
     sliding_window_marginalize.cpp sliding_window_behind.cpp sliding_window_covariance.cpp window_plane_graph.cpp plane_index.cpp association.cpp
     plane_evidence.cpp boundaries.cpp piece_gap.cpp crossing_planes.cpp outline_sharing.cpp surfel_estimator.cpp
     place_recognition.cpp plane_labels.cpp level_gaps.cpp sight_gaps.cpp hidden_doubles.cpp plane_parts.cpp plane_creases.cpp plane_ghosts.cpp seen_plane.cpp ground_strokes.cpp mapper.cpp mapper_associate.cpp mapper_planes.cpp mapper_loops.cpp mapper_merge.cpp
     mapper_map.cpp shared_planes.cpp plane_split.cpp plane_doubles.cpp plane_agreement.cpp waiting_doubles.cpp plane_neighbourhood.cpp views_apart.cpp shifted_names.cpp
     map_state.cpp free_space.cpp plan_walls.cpp place_search.cpp map_overlap.cpp frame_log.cpp online_upkeep.cpp shared_errors.cpp wheel_errors.cpp depth_errors.cpp)
