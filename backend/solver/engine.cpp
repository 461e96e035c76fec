// Which engine, and what of a graph needs none.
#include <lamina/backend/solver/engine.hpp>

#include <lamina/backend/graph/factors/of_sensor.hpp>
#include <lamina/backend/graph/factors/segment.hpp>
#include <lamina/backend/solver/ceres/ceres_engine.hpp>
#include <lamina/backend/solver/native/native_engine.hpp>

namespace lamina {

const char* to_string(SolverEngine engine) {
  return engine == SolverEngine::kCeres ? "ceres" : "native";
}

const char* to_string(SolveStatus status) {
  constexpr const char* kNames[] = {"converged", "max_iterations",   "stalled",
                                    "cancelled", "nothing_to_solve", "invalid_input"};
  return kNames[static_cast<int>(status)];
}

double total(const CostByType& cost) {
  double sum = 0;
  for (const double c : cost) sum += c;
  return sum;
}

RobustWeights chi_squared_of(const Graph& graph) {
  RobustWeights all;
  const auto pose = [&](KeyframeId id) { return PoseState(graph.at(id).T_map_body); };
  for (const LoopFactor& f : graph.loops) {
    Vector6d r;
    if (const Extrinsics* sensor = moving_sensor(graph, f.extrinsics)) {
      OdometryOfSensorTerm(f, *sensor)
          .evaluate(pose(f.from), pose(f.to), PoseState(sensor->state), r, nullptr);
    } else {
      OdometryTerm(f).evaluate(pose(f.from), pose(f.to), r, nullptr);
    }
    all.loops.push_back(r.squaredNorm());
  }
  for (const SegmentFactor& f : graph.segments) {
    const PlaneLandmark& plane = graph.at(f.plane);
    Eigen::Vector2d r;
    SegmentTerm(f, plane.anchor_map)
        .evaluate(pose(f.keyframe), PlaneState(plane.plane_anchor), r, nullptr);
    all.segments.push_back(r.squaredNorm());
  }
  for (const PlaneMomentsFactor& f : graph.plane_moments) {
    all.plane_moments.push_back(chi_squared(graph, f, graph.at(f.plane)));
  }
  for (const CustomFactor& f : graph.custom) {
    CustomEvaluation e;
    const bool asked = f.may_be_wrong;
    const bool evaluated = asked && evaluate_at(f, graph, e);
    all.custom.push_back(evaluated ? e.chi_squared_of_three()
                         : asked   ? std::numeric_limits<double>::infinity()
                                   : 0.0);
  }
  return all;
}

std::unique_ptr<BatchEngine> make_engine(const Graph& graph, SolverEngine engine, Parts parts) {
  if (engine == SolverEngine::kCeres) return std::make_unique<CeresEngine>(graph, parts);
  return std::make_unique<NativeEngine>(graph, parts);
}

}  // namespace lamina
