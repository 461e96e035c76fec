// Plane graphs of any size: rooms on a square grid, visited in order, several laps.
#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <lamina/pipeline/evaluation/plane_graph.hpp>

namespace lamina::test {

struct RoomOptions {
  int rooms = 9;
  int poses_per_room = 11;
  int laps = 2;
  double sigma_translation = 0.01, sigma_rotation = 0.002, sigma_point = 0.01;
  int points = 30;   ///< of each observation
  double wrong = 0;  ///< share of observations given to a random plane
  std::uint64_t seed = 1;
};

/// Six planes of a room and a tilted panel; a pose sees what it faces, some four of them.
inline PlaneGraph make_rooms(const RoomOptions& options) {
  std::mt19937_64 engine(options.seed);
  std::mt19937_64 names(options.seed + 1000);  // of its own: wrong names leave the noise as it is
  const auto draw_name = [&] { return std::uniform_real_distribution<double>(0, 1)(names); };
  const auto normal = [&] { return std::normal_distribution<double>()(engine); };
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(engine);
  };
  PlaneGraph g;
  g.sigma_translation = options.sigma_translation;
  g.sigma_rotation = options.sigma_rotation;
  g.sigma_point = options.sigma_point;
  const int width = std::max(1, static_cast<int>(std::lround(std::sqrt(options.rooms))));
  std::vector<Eigen::Vector3d> centers;
  for (int r = 0; r < options.rooms; ++r) {
    const int row = r / width, column = row % 2 == 0 ? r % width : width - 1 - r % width;
    const Eigen::Vector3d c(6.0 * column + 3, 6.0 * row + 3, 0);
    centers.push_back(c);
    const double half = 2.9 + uniform(-0.1, 0.05);
    const auto wall = [&](double nx, double ny) {
      const Eigen::Vector3d n(nx, ny, 0);
      g.truth_planes.emplace_back(n, n.dot(c) - half);
    };
    wall(1, 0);
    wall(-1, 0);
    wall(0, 1);
    wall(0, -1);
    g.truth_planes.emplace_back(Eigen::Vector3d::UnitZ(), 0.0);
    g.truth_planes.emplace_back(-Eigen::Vector3d::UnitZ(), -2.8);
    const double a = uniform(0, 2 * M_PI);
    const Eigen::Vector3d n = Eigen::Vector3d(0.3 * std::cos(a), 0.3 * std::sin(a), 1).normalized();
    g.truth_planes.emplace_back(n, n.dot(c) - 0.4);
  }
  g.plane_count = static_cast<int>(g.truth_planes.size());
  for (int lap = 0; lap < options.laps; ++lap) {
    for (int r = 0; r < options.rooms; ++r) {
      for (int k = 0; k < options.poses_per_room; ++k) {
        const double a = 2 * M_PI * k / options.poses_per_room + 0.1 * lap;
        const SO3 R = SO3::rot_z(a + M_PI / 2) * SO3::rot_y(0.1 * std::sin(3 * a)) *
                      SO3::rot_x(0.08 * std::cos(2 * a));
        const Eigen::Vector3d t(1.5 * std::cos(a), 1.5 * std::sin(a), 1.2 + 0.25 * std::sin(5 * a));
        const SE3 T(R, centers[static_cast<std::size_t>(r)] + t);
        const int pose = static_cast<int>(g.truth_map_body.size());
        g.truth_map_body.push_back(T);
        for (int p = 7 * r; p < 7 * r + 7; ++p) {
          const Plane& plane = g.truth_planes[static_cast<std::size_t>(p)];
          const Eigen::Vector3d facing = R * Eigen::Vector3d::UnitX();
          if (plane.normal().dot(facing) > 0.25) continue;
          const Matrix32d B = plane.tangent_basis();
          const Eigen::Vector3d middle =
              plane.project(T.translation()) + B * Eigen::Vector2d(uniform(-1, 1), uniform(-1, 1));
          PlaneGraph::Observation o;
          o.pose = pose;
          o.plane = draw_name() < options.wrong
                        ? static_cast<int>(0.999999 * draw_name() * g.plane_count)
                        : p;
          for (int i = 0; i < options.points; ++i) {
            const Eigen::Vector3d x = middle + B * Eigen::Vector2d(uniform(-1, 1), uniform(-1, 1)) +
                                      options.sigma_point * normal() * plane.normal();
            o.moments_body.add(T.inverse() * x);
          }
          g.observations.push_back(std::move(o));
        }
      }
    }
  }
  g.initial_map_body.push_back(g.truth_map_body.front());
  for (std::size_t i = 1; i < g.truth_map_body.size(); ++i) {
    Vector6d noise;
    for (int k = 0; k < 6; ++k) {
      noise(k) = normal() * (k < 3 ? options.sigma_translation : options.sigma_rotation);
    }
    const SE3 step = g.truth_map_body[i - 1].inverse() * g.truth_map_body[i] * SE3::exp(noise);
    g.odometry.push_back({static_cast<int>(i) - 1, static_cast<int>(i), step});
    g.initial_map_body.push_back(g.initial_map_body.back() * step);
  }
  return g;
}

/// The same building, path and associations under another draw of the noise that it states: steps
/// of odometry, and of each observation distance and tilts of the points it had.
inline PlaneGraph redrawn(PlaneGraph problem, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  for (auto& o : problem.odometry) {
    Vector6d noise;
    for (int k = 0; k < 6; ++k) {
      noise(k) = normal(engine) * (k < 3 ? problem.sigma_translation : problem.sigma_rotation);
    }
    const auto from = static_cast<std::size_t>(o.from), to = static_cast<std::size_t>(o.to);
    o.T_from_to =
        problem.truth_map_body[from].inverse() * problem.truth_map_body[to] * SE3::exp(noise);
    if (o.to == o.from + 1)
      problem.initial_map_body[to] = problem.initial_map_body[from] * o.T_from_to;
  }
  for (auto& o : problem.observations) {
    const Plane plane = problem.truth_map_body[static_cast<std::size_t>(o.pose)].inverse() *
                        problem.truth_planes[static_cast<std::size_t>(o.plane)];
    const Eigen::Vector3d& n = plane.normal();
    const Matrix32d B = plane.tangent_basis();
    const double count = o.moments_body.weight(), sigma = problem.sigma_point;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> in_plane(
        Eigen::Matrix2d(B.transpose() * o.moments_body.scatter() * B));
    Eigen::Matrix3d scatter =
        std::max(0.0, count - 3) * sigma * sigma * n * n.transpose();  // off their own best plane
    for (int k = 0; k < 2; ++k) {
      const double extent = std::sqrt(std::max(0.0, in_plane.eigenvalues()(k)));
      const Eigen::Vector3d l =
          extent * (B * in_plane.eigenvectors().col(k)) + sigma * normal(engine) * n;
      scatter += l * l.transpose();
    }
    const Eigen::Vector3d mean =
        plane.project(o.moments_body.mean()) + sigma / std::sqrt(count) * normal(engine) * n;
    o.moments_body = Moments(count, mean, scatter, o.moments_body.count());
  }
  return problem;
}

/// A plane that no pose saw for longer than the window keeps it is another plane from then on.
inline PlaneGraph without_returns(PlaneGraph problem, int longest_gap) {
  std::vector<int> last(static_cast<std::size_t>(problem.plane_count), -1), name(last);
  std::stable_sort(problem.observations.begin(), problem.observations.end(),
                   [](const auto& a, const auto& b) { return a.pose < b.pose; });
  std::vector<Plane> truth;
  for (auto& o : problem.observations) {
    const auto j = static_cast<std::size_t>(o.plane);
    if (last[j] < 0 || o.pose - last[j] > longest_gap) {
      name[j] = static_cast<int>(truth.size());
      truth.push_back(problem.truth_planes[j]);
    }
    last[j] = o.pose;
    o.plane = name[j];
  }
  problem.plane_count = static_cast<int>(truth.size());
  problem.truth_planes = truth;
  return problem;
}

}  // namespace lamina::test
