// How the values of models/ are archived: one list of members a type.
#pragma once

#include <lamina/models/archive.hpp>
#include <lamina/models/depth_look.hpp>
#include <lamina/models/ground_look.hpp>
#include <lamina/models/moments.hpp>
#include <lamina/models/outline_grid.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/models/scan_segment.hpp>
#include <lamina/models/surfel.hpp>
#include <lamina/models/timestamp.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

template <class A>
void fields(A& a, Timestamp& v) {
  std::int64_t ns = v.nanoseconds();
  a(ns);
  v = Timestamp::from_nanoseconds(ns);
}

template <class A>
void fields(A& a, DepthLook& v) {
  a(v.fx, v.fy, v.cx, v.cy, v.pixel, v.noise, v.nx, v.ny, v.reach);
}
template <class A>
void fields(A& a, GroundMark& v) {
  a(v.xy, v.height, v.sigma);
}
template <class A>
void fields(A& a, GroundLook& v) {
  a(v.origin, v.cell_m, v.nx, v.ny, v.floor_bits, v.marks);
}

// The constructor would normalise: a class of standard layout begins with its first member, so the
// quaternion is written and read where it stands.
static_assert(std::is_standard_layout_v<SO3> && sizeof(SO3) == 4 * sizeof(double));
template <class A>
void fields(A& a, SO3& v) {
  a(reinterpret_cast<Eigen::Quaterniond*>(&v)->coeffs());
}

template <class A>
void fields(A& a, SE3& v) {
  SO3 rotation = v.so3();
  Eigen::Vector3d translation = v.translation();
  a(rotation, translation);
  v = SE3(rotation, translation);
}

// Unit to rounding is kept as it is by the constructor.
template <class A>
void fields(A& a, Plane& v) {
  Eigen::Vector3d normal = v.normal();
  double rho = v.rho();
  a(normal, rho);
  if constexpr (A::kReading) v = Plane(normal, rho);
}

template <class A>
void fields(A& a, OutlineGrid& v) {
  double cell_size = v.cell_size();
  std::vector<OutlineGrid::Cell> cells;
  if constexpr (!A::kReading) cells = v.cells();
  a(cell_size, cells);
  if constexpr (A::kReading) {
    v = OutlineGrid(cell_size);
    for (const auto& cell : cells) v.add_cell(cell);
  }
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
void fields(A& a, NoiseFloor& v) {
  a(v.sigma_rho, v.sigma_tilt, v.sigma_bend);
}

template <class A>
void fields(A& a, Surfel& v) {
  a(v.center, v.normal, v.radius, v.covariance, v.parent_plane, v.anchor_keyframe);
}

template <class A>
void fields(A& a, ScanSegment& v) {
  a(v.rho, v.theta, v.covariance, v.start, v.end, v.moments, v.first_beam, v.last_beam, v.count,
    v.chi_squared);
}

template <class A>
void fields(A& a, EdgePoint& v) {
  a(v.position_map, v.sigma, v.negative);
}

template <class A>
void fields(A& a, StampedPose& v) {
  a(v.stamp, v.pose);
}

template <class A>
void fields(A& a, Trajectory& v) {
  std::vector<StampedPose> poses(v.begin(), v.end());
  a(poses);
  if constexpr (A::kReading) {
    v = Trajectory();
    for (const StampedPose& p : poses) v.add(p.stamp, p.pose);
  }
}

}  // namespace lamina
