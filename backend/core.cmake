list(APPEND LAMINA_BACKEND_SOURCES
  graph.cpp graph_move.cpp graph_problems.cpp plane_graph.cpp manifolds.cpp
  factors/states.cpp factors/pose_factors.cpp factors/plane_factors.cpp factors/surfel_factors.cpp
  factors/marginal_prior.cpp factors/costs.cpp
  block_cholesky.cpp block_inverse.cpp normal_equations.cpp normal_equations_terms.cpp minimizer.cpp turning_start.cpp
  consensus.cpp plane_refit.cpp track_planes.cpp robust.cpp believing.cpp loop_hearing.cpp merge_hearing.cpp refiner.cpp plane_graph_solve.cpp problem_builder.cpp covariance.cpp mounting_doubt.cpp)
