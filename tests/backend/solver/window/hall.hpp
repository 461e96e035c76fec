// A robot in a hall of five planes, for windows.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include <lamina/backend/solver/window/sliding_window.hpp>

namespace lamina::test {

// A robot on a gentle curve through a hall of five planes; every number from a seed.
struct Hall {
  std::vector<SE3> truth;
  std::vector<Plane> planes;
  std::vector<OdometryFactor> odometry;
  std::vector<PlaneMomentsFactor> sightings;
  std::vector<SE3> guess;
  Matrix6d S = Matrix6d::Zero();

  Hall(int poses, double noise, unsigned seed, const SE3& T_world = SE3()) {
    std::mt19937 rng(seed);
    std::normal_distribution<double> normal;
    const double st = 0.01, sr = 0.002, sp = 0.005;
    S.diagonal() << Eigen::Vector3d::Constant(1 / st), Eigen::Vector3d::Constant(1 / sr);
    const std::vector<Plane> local{
        {{0, 0, 1}, 0}, {{0, -1, 0}, -4}, {{0, 1, 0}, -4}, {{-1, 0, 0}, -12}, {{0, 0, -1}, -3}};
    for (const auto& plane : local) planes.push_back(T_world * plane);
    for (int i = 0; i < poses; ++i) {
      truth.push_back(T_world * SE3(SO3::rot_z(0.05 * i) * SO3::rot_x(0.02 * std::sin(i)),
                                    {0.3 * i, 0.5 * std::sin(0.2 * i), 0.5}));
    }
    guess.push_back(truth[0]);
    for (int i = 0; i + 1 < poses; ++i) {
      Vector6d e;
      for (int k = 0; k < 6; ++k) e(k) = noise * normal(rng) * (k < 3 ? st : sr);
      const SE3 T = truth[i].inverse() * truth[i + 1] * SE3::exp(e);
      odometry.push_back({KeyframeId(i), KeyframeId(i + 1), T, S});
      guess.push_back(guess.back() * T);
    }
    for (int i = 0; i < poses; ++i) {
      for (std::size_t j = 0; j < planes.size(); ++j) {
        if ((i + int(j)) % 3 == 0) continue;  // not every plane from everywhere
        Plane seen = truth[i].inverse() * planes[j];
        const Eigen::Vector3d middle = seen.project(Eigen::Vector3d(1 + 0.1 * j, 0.2 * i, 0));
        seen = seen.about(middle)
                   .boxplus(noise * Eigen::Vector3d(0.001 * normal(rng), 0.001 * normal(rng),
                                                    0.001 * normal(rng)))
                   .about(-middle);
        const Matrix32d B = seen.tangent_basis();
        const double w = 100 / (sp * sp);
        sightings.push_back({KeyframeId(i), PlaneId(std::int64_t(j)),
                             Moments(w, seen.project(middle), B * (0.25 * w) * B.transpose(), 100),
                             ExtrinsicsId::kNone, 1.0});
      }
    }
  }

  void feed(SlidingWindow& window, std::size_t i, bool prior = true) const {
    const auto id = static_cast<KeyframeId>(i);
    const SE3 start =
        i == 0 ? guess[0] : window.pose(KeyframeId(int(i) - 1)) * odometry[i - 1].T_from_to;
    window.add_keyframe(id, Timestamp::from_nanoseconds(int(i)), start);
    if (i == 0 && prior) window.add(PriorFactor{id, truth[0], Matrix6d::Identity() * 1e4});
    if (i > 0) window.add(odometry[i - 1]);
    for (const auto& s : sightings) {
      if (s.keyframe != id) continue;
      const auto j = static_cast<std::size_t>(s.plane);
      if (!window.contains(s.plane)) {
        const Eigen::Vector3d anchor = planes[j].project(truth[0].translation());
        window.add_plane(s.plane, planes[j].about(anchor), anchor);
      }
      window.add(s);
    }
  }
};

}  // namespace lamina::test
