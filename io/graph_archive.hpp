// How the graph's types are archived: one list of members a type. Private to io/.
#pragma once

#include <lamina/backend/graph.hpp>
#include <lamina/io/archive.hpp>
#include <lamina/models/planar_map.hpp>

namespace lamina {

// These live beside the types, where argument-dependent look-up finds them.
template <class A>
void fields(A& a, Timestamp& v) {
  std::int64_t ns = v.nanoseconds();
  a(ns);
  v = Timestamp::from_nanoseconds(ns);
}

template <class A>
void fields(A& a, SE3& v) {
  Eigen::Vector4d q = v.so3().quaternion().coeffs();
  Eigen::Vector3d t = v.translation();
  a(q, t);
  if constexpr (A::kReading) v = SE3(SO3(Eigen::Quaterniond(q)), t);
}

template <class A>
void fields(A& a, Plane& v) {
  Eigen::Vector3d normal = v.normal();
  double rho = v.rho();
  a(normal, rho);
  if constexpr (A::kReading) v = Plane(normal, rho);
}

template <class A>
void fields(A& a, Moments& v) {
  double weight = v.weight();
  Eigen::Vector3d mean = v.mean();
  Eigen::Matrix3d scatter = v.scatter();
  std::int64_t count = v.count();
  a(weight, mean, scatter, count);
  if constexpr (A::kReading) v = Moments(weight, mean, scatter, count);
}

template <class A>
void fields(A& a, OutlineGrid& v) {
  double cell_size = v.cell_size();
  std::vector<std::int32_t> flat;
  if constexpr (!A::kReading) {
    for (const auto& [i, j] : v.cells()) {
      flat.push_back(i);
      flat.push_back(j);
    }
  }
  a(cell_size, flat);
  if constexpr (A::kReading) {
    v = OutlineGrid(cell_size);
    for (std::size_t k = 0; k + 1 < flat.size(); k += 2) {
      v.add_cell({flat[k], flat[k + 1]});
    }
  }
}

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
  a(v.id, v.T_body_sensor, v.state, v.prior_sigma, v.estimate);
}
template <class A>
void fields(A& a, OdometryFactor& v) {
  a(v.from, v.to, v.T_from_to, v.sqrt_information);
}
template <class A>
void fields(A& a, PlanarOdometryFactor& v) {
  a(v.from, v.to, v.T_from_to, v.sqrt_information);
}
template <class A>
void fields(A& a, LoopFactor& v) {
  a(v.from, v.to, v.T_from_to, v.sqrt_information, v.weight);
}
template <class A>
void fields(A& a, PriorFactor& v) {
  a(v.keyframe, v.T_map_body, v.sqrt_information);
}
template <class A>
void fields(A& a, PlaneMomentsFactor& v) {
  a(v.keyframe, v.plane, v.moments_body, v.extrinsics, v.weight);
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
template <class A>
void fields(A& a, Graph& v) {
  a(v.keyframes, v.planes, v.surfels, v.extrinsics, v.odometry, v.planar_odometry, v.loops,
    v.priors, v.plane_moments, v.segments, v.gravity, v.surfel_moments, v.surfel_parents,
    v.marginal_priors, v.next_keyframe, v.next_plane, v.next_surfel, v.next_extrinsics);
}

}  // namespace lamina
