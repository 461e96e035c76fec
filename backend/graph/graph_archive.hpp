// How the graph's types are archived: one list of members a type.
#pragma once

#include <lamina/backend/graph/graph.hpp>
#include <lamina/models/model_archive.hpp>

namespace lamina {

template <class A>
void fields(A& a, Keyframe& v) {
  a(v.id, v.stamp, v.T_map_body, v.fixed);
}
template <class A>
void fields(A& a, LabelVotes& v) {
  a(v.floor, v.sub_dominant, v.obstacle);
}
template <class A>
void fields(A& a, PlaneLandmark& v) {
  a(v.id, v.anchor_map, v.plane_anchor, v.covariance, v.T_map_outline, v.outline, v.observations,
    v.first_seen, v.last_seen, v.votes, v.active, v.merged_into, v.fixed);
}
template <class A>
void fields(A& a, SurfelLandmark& v) {
  a(v.id, v.anchor, v.T_body_cell, v.radius, v.state, v.covariance, v.parent);
}
template <class A>
void fields(A& a, Extrinsics& v) {
  a(v.id, v.sensor, v.T_body_sensor, v.state, v.prior, v.prior_sigma, v.estimate);
}
template <class A>
void fields(A& a, OdometryFactor& v) {
  a(v.from, v.to, v.T_from_to, v.sqrt_information, v.extrinsics);
}
template <class A>
void fields(A& a, PlanarOdometryFactor& v) {
  a(v.from, v.to, v.T_from_to, v.sqrt_information);
}
template <class A>
void fields(A& a, LoopFactor& v) {
  a(v.from, v.to, v.T_from_to, v.sqrt_information, v.weight, v.extrinsics);
}
template <class A>
void fields(A& a, PriorFactor& v) {
  a(v.keyframe, v.T_map_body, v.sqrt_information);
}
template <class A>
void fields(A& a, SensorMoments& v) {
  a(v.extrinsics, v.moments_body);
}
template <class A>
void fields(A& a, PlaneMomentsFactor& v) {
  a(v.keyframe, v.plane, v.moments_body, v.extrinsics, v.weight, v.by_sensor);
}
template <class A>
void fields(A& a, SegmentFactor& v) {
  a(v.keyframe, v.plane, v.start_body, v.end_body, v.sqrt_information, v.weight);
}
template <class A>
void fields(A& a, GravityFactor& v) {
  a(v.keyframe, v.up_body, v.sigma);
}
template <class A>
void fields(A& a, SurfelMomentsFactor& v) {
  a(v.keyframe, v.surfel, v.moments_body);
}
template <class A>
void fields(A& a, SurfelParentFactor& v) {
  a(v.surfel, v.plane, v.sigma_height, v.sigma_slope);
}
template <class A>
void fields(A& a, MarginalPrior& v) {
  a(v.keyframes, v.poses_linear, v.planes, v.planes_linear, v.surfels, v.surfels_linear,
    v.sqrt_information, v.residual);
}
/// A kind of manifold or factor comes back as it is registered.
template <class A>
void fields(A& a, CustomState& v) {
  a(v.id, v.kind, v.values, v.fixed);
  if constexpr (A::kReading) {
    if (!v.kind.empty()) v.manifold = find_manifold(v.kind);
  }
}
/// By number: which kind of state, and its id.
template <class A>
void fields(A& a, StateRef& v) {
  std::uint8_t kind = static_cast<std::uint8_t>(v.index());
  std::int64_t id = std::visit([](auto one) { return static_cast<std::int64_t>(one); }, v);
  a(kind, id);
  if constexpr (A::kReading) {
    v = kind == 0 ? StateRef(KeyframeId(id)) : StateRef(CustomStateId(id));
  }
}
template <class A>
void fields(A& a, CustomFactor& v) {
  a(v.kind, v.states, v.data, v.may_be_wrong, v.weight);
  if constexpr (A::kReading) {
    const CustomFactor made = make_factor(v.kind, v.data);
    v.cost = made.cost;
    v.loss = made.loss;
  }
}
template <class A>
void fields(A& a, Graph& v) {
  a(v.keyframes, v.planes, v.surfels, v.extrinsics, v.odometry, v.planar_odometry, v.loops,
    v.priors, v.plane_moments, v.segments, v.gravity, v.surfel_moments, v.surfel_parents,
    v.marginal_priors, v.next_keyframe, v.next_plane, v.next_surfel, v.next_extrinsics,
    v.custom_states, v.custom, v.next_custom_state);
}

}  // namespace lamina
