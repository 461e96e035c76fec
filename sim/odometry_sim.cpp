// Noisy increments, integrated.
#include <lamina/sim/odometry_sim.hpp>

#include <algorithm>
#include <cmath>

namespace lamina::sim {
namespace {
constexpr std::uint64_t kOdometryStream = 7;
}

OdometrySimulator::OdometrySimulator(const OdometryErrors& errors, std::uint64_t seed)
    : errors_(errors), random_(seed, kOdometryStream) {
  std::sort(errors_.faults.begin(), errors_.faults.end(),
            [](const OdometryFault& a, const OdometryFault& b) { return a.time < b.time; });
}

SE3 OdometrySimulator::noisy(const SE3& T_from_to) {
  Vector6d d = T_from_to.log();
  const double distance = d.head<3>().norm(), turn = d.tail<3>().norm();
  const double sigma_t = errors_.sigma_translation * std::sqrt(distance);
  const double sigma_r =
      std::sqrt(errors_.sigma_rotation * errors_.sigma_rotation * distance +
                errors_.sigma_rotation_turn * errors_.sigma_rotation_turn * turn);
  d.head<3>() *= errors_.scale;
  d[5] += errors_.drift * distance;
  for (int k = 0; k < 6; ++k) {
    const double n = random_.normal();
    d[k] += errors_.noise ? n * (k < 3 ? sigma_t : sigma_r) : 0;
  }
  if (errors_.planar) {
    d[2] = d[3] = d[4] = 0;
  }
  return SE3::exp(d);
}

Odometry OdometrySimulator::step(Timestamp stamp, double time, const SE3& T_map_body) {
  if (!last_map_body_) {
    T_odom_body_ = T_map_body;
  } else {
    T_odom_body_ = T_odom_body_ * noisy(last_map_body_->inverse() * T_map_body);
  }
  last_map_body_ = T_map_body;
  while (next_fault_ < errors_.faults.size() && errors_.faults[next_fault_].time <= time) {
    const OdometryFault& fault = errors_.faults[next_fault_++];
    T_odom_body_ = SE3(T_odom_body_.so3() * SO3::exp(fault.rotation_body),
                       T_odom_body_.translation() + fault.translation_odom);
  }
  return {stamp, T_odom_body_};
}

}  // namespace lamina::sim
