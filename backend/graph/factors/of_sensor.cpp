// Terms of a body's pose, evaluated at a sensor's.
#include <lamina/backend/graph/factors/of_sensor.hpp>

namespace lamina {

void PlaneMomentsOfSensorTerm::evaluate(const PoseState& pose, const PlaneState& plane,
                                        const PoseState& sensor, Residual& residual,
                                        Jacobians* J) const {
  const PoseState T_map_sensor = pose * sensor;
  if (J == nullptr) {
    of_sensor.evaluate(T_map_sensor, plane, residual, nullptr);
    return;
  }
  PlaneMomentsTerm::Jacobians at;
  of_sensor.evaluate(T_map_sensor, plane, residual, &at);
  std::get<0>(*J).noalias() = std::get<0>(at) * sensor.se3().inverse().adjoint();
  std::get<1>(*J) = std::get<1>(at);
  std::get<2>(*J) = std::get<0>(at);
}

void OdometryOfSensorTerm::evaluate(const PoseState& a, const PoseState& b, const PoseState& sensor,
                                    Vector6d& residual, Jacobians* J) const {
  const PoseState T_map_a = a * sensor, T_map_b = b * sensor;
  if (J == nullptr) {
    of_sensor.evaluate(T_map_a, T_map_b, residual, nullptr);
    return;
  }
  OdometryTerm::Jacobians at;
  of_sensor.evaluate(T_map_a, T_map_b, residual, &at);
  const Matrix6d to_sensor = sensor.se3().inverse().adjoint();
  std::get<0>(*J).noalias() = std::get<0>(at) * to_sensor;
  std::get<1>(*J).noalias() = std::get<1>(at) * to_sensor;
  std::get<2>(*J) = std::get<0>(at) + std::get<1>(at);
}

double chi_squared(const Graph& graph, const PlaneMomentsFactor& view, const PlaneLandmark& plane) {
  const SE3& T = graph.at(view.keyframe).T_map_body;
  const SE3 T_anchor_body(T.so3(), T.translation() - plane.anchor_map);
  double sum = 0;
  for_each_part(graph, view, [&](const Moments& moments_body, const Extrinsics* sensor) {
    const SE3 T_anchor_made =
        sensor ? T_anchor_body * sensor->state * sensor->T_body_sensor.inverse() : T_anchor_body;
    sum += moments_body.cost(T_anchor_made.inverse() * plane.plane_anchor);
  });
  return sum;
}

void make_factors_anew(Graph& graph) {
  // By sensor: where its points go.
  const auto motion = [&graph](ExtrinsicsId id) -> std::optional<SE3> {
    const Extrinsics* sensor = moving_sensor(graph, id);
    if (!sensor) return std::nullopt;
    return sensor->state * sensor->T_body_sensor.inverse();
  };
  const auto move = [&motion](auto& factor) {
    const std::optional<SE3> C = motion(factor.extrinsics);
    if (!C) return;
    factor.T_from_to = *C * factor.T_from_to * C->inverse();
    factor.sqrt_information = factor.sqrt_information * C->inverse().adjoint();
  };
  for (OdometryFactor& f : graph.odometry) move(f);
  for (LoopFactor& f : graph.loops) move(f);
  for (PlaneMomentsFactor& f : graph.plane_moments) {
    if (const auto C = motion(f.extrinsics)) f.moments_body = f.moments_body.transformed(*C);
    if (f.by_sensor.empty()) continue;
    f.moments_body = Moments();
    for (SensorMoments& part : f.by_sensor) {
      if (const auto C = motion(part.extrinsics))
        part.moments_body = part.moments_body.transformed(*C);
      f.moments_body.merge(part.moments_body);
    }
  }
  for (Extrinsics& e : graph.extrinsics) e.T_body_sensor = e.state;
}

}  // namespace lamina
