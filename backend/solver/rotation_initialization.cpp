// Turns by Gauss-Newton, positions by one linear system.
#include <lamina/backend/solver/rotation_initialization.hpp>

#include <cmath>
#include <limits>

namespace lamina {

GraphStates states_of(const Graph& graph) {
  GraphStates states;
  for (const Keyframe& k : graph.keyframes) states.poses.push_back(k.T_map_body);
  for (const PlaneLandmark& p : graph.planes) states.planes.push_back(p.plane_anchor);
  for (const SurfelLandmark& s : graph.surfels) states.surfels.push_back(s.state);
  for (const Extrinsics& e : graph.extrinsics) states.sensors.push_back(e.state);
  for (const CustomState& c : graph.custom_states) states.custom.push_back(c.values);
  return states;
}

void put_back(const GraphStates& states, Graph& graph) {
  for (std::size_t i = 0; i < states.poses.size(); ++i) {
    graph.keyframes[i].T_map_body = states.poses[i];
  }
  for (std::size_t i = 0; i < states.planes.size(); ++i) {
    if (graph.planes[i].active) graph.planes[i].set_plane_anchor(states.planes[i]);
  }
  for (std::size_t i = 0; i < states.surfels.size(); ++i) {
    graph.surfels[i].state = states.surfels[i];
  }
  for (std::size_t i = 0; i < states.sensors.size(); ++i) {
    graph.extrinsics[i].state = states.sensors[i];
  }
  for (std::size_t i = 0; i < states.custom.size(); ++i) {
    graph.custom_states[i].values = states.custom[i];
  }
}

RotationInitialization start_from_turns(Graph& graph, BatchEngine& all, SolverEngine engine,
                                        double cost, double least_turn) {
  RotationInitialization start;
  const GraphStates before = states_of(graph);
  {
    const auto turns = make_engine(graph, engine, Parts::kTurns);
    MinimizerOptions options;
    options.max_iterations = 12;
    options.relative_tolerance = 1e-2;  // a start needs no more
    options.initial_damping = 1e-9;     // with none the first step of 100,000 poses overshoots
    // What a step's model was wrong by is about what the next one can still gain.
    double cost_before = std::numeric_limits<double>::infinity();
    bool asked = !(least_turn > 0);
    start.far = asked;
    const auto go_on = [&](const Iteration& it) {
      if (!asked && it.largest_turn > 0) {  // the first system that could be solved
        asked = true;
        start.far = it.largest_turn >= least_turn;
      }
      if (!asked) return true;
      const double wrong = std::abs(it.predicted_decrease - (cost_before - it.cost));
      cost_before = it.cost;
      return start.far && !(it.accepted && wrong < options.relative_tolerance * it.cost);
    };
    start.iterations = turns->minimize(options, go_on).iterations;
    if (!start.far) return start;
    turns->write(graph);
  }
  all.read(graph);
  ++start.iterations;
  if (all.let_positions_follow() && total(all.cost()) < cost) {
    all.write(graph);
  } else {
    put_back(before, graph);
    all.read(graph);
  }
  return start;
}

}  // namespace lamina
