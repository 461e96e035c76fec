// What a sensor measured, with the sensor's place on the body as a state: planes that it saw and
// motions of its own.
//
// A factor's term is one of a body's pose T. Written in the sensor's frame (x_sensor = E0^-1
// x_body, E0 the mounting by which the factor was made) it is one of the sensor's pose T E, E the
// state:
//   r(T, E) = r_sensor(T E),   dr/dE = J_sensor,   dr/dT = J_sensor Adj(E^-1)
// for right perturbations, J_sensor the term's own Jacobian at T E; of two poses, as of a motion,
// dr/dE = J_sensor,a + J_sensor,b. A motion Z of the body is E0^-1 Z E0 of the sensor, and
// log(E0^-1 Z E0) = Adj(E0^-1) log(Z): at E = E0 the residual is that of the body's term exactly.
#pragma once

#include <lamina/backend/graph/factors/odometry.hpp>
#include <lamina/backend/graph/factors/plane_moments.hpp>

namespace lamina {

struct PlaneMomentsOfSensorTerm {
  static constexpr int kResiduals = 4;
  using Residual = Eigen::Vector4d;
  using Jacobians = TermJacobians<4, PoseState, PlaneState, PoseState>;
  PlaneMomentsTerm of_sensor;

  PlaneMomentsOfSensorTerm() = default;
  PlaneMomentsOfSensorTerm(const Moments& moments_body, const Eigen::Vector3d& anchor,
                           const Extrinsics& sensor)
      : of_sensor(moments_body.transformed(sensor.T_body_sensor.inverse()), anchor) {}

  void evaluate(const PoseState& pose, const PlaneState& plane, const PoseState& sensor,
                Residual& residual, Jacobians* J) const;
};

struct OdometryOfSensorTerm {
  static constexpr int kResiduals = 6;
  using Jacobians = TermJacobians<6, PoseState, PoseState, PoseState>;
  OdometryTerm of_sensor;

  OdometryOfSensorTerm() = default;
  /// `Factor`: OdometryFactor or LoopFactor.
  template <class Factor>
  OdometryOfSensorTerm(Factor factor, const Extrinsics& sensor) {
    const SE3& E = sensor.T_body_sensor;
    factor.T_from_to = E.inverse() * factor.T_from_to * E;
    factor.sqrt_information = factor.sqrt_information * E.adjoint();
    of_sensor = OdometryTerm(factor);
  }

  void evaluate(const PoseState& a, const PoseState& b, const PoseState& sensor, Vector6d& residual,
                Jacobians* J) const;
};

/// The sensor whose state a factor reads; null where its factors stand as they were made.
inline const Extrinsics* moving_sensor(const Graph& graph, ExtrinsicsId id) {
  if (id == ExtrinsicsId::kNone) return nullptr;
  const Extrinsics& sensor = graph.at(id);
  return sensor.held_as_made() ? nullptr : &sensor;
}

/// f(moments_body, sensor or null) for what each sensor saw of a view; once with all of it where no
/// sensor of it moves.
template <class F>
void for_each_part(const Graph& graph, const PlaneMomentsFactor& view, F&& f) {
  bool moves = false;
  for (const SensorMoments& part : view.by_sensor) {
    moves = moves || moving_sensor(graph, part.extrinsics) != nullptr;
  }
  if (!moves) {
    f(view.moments_body, moving_sensor(graph, view.extrinsics));
    return;
  }
  for (const SensorMoments& part : view.by_sensor) {
    f(part.moments_body, moving_sensor(graph, part.extrinsics));
  }
}

/// Chi-squared of a view on `plane` at the graph's states, its weight left aside.
double chi_squared(const Graph& graph, const PlaneMomentsFactor& view, const PlaneLandmark& plane);

/// Factors as they would be had every sensor been known to sit at its state; T_body_sensor is that
/// from then on. The residuals stay what they are.
void make_factors_anew(Graph& graph);

}  // namespace lamina
