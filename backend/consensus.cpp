// Pairwise agreement of a plane's observations within what odometry can tell.
#include <lamina/backend/consensus.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <lamina/models/linalg.hpp>

namespace lamina {
namespace {

constexpr double kFarthestSigma = 0.3;   // m: beyond this drift a comparison tells nothing
constexpr std::size_t kNeighbours = 16;  // observations ahead that each is compared with

/// Variance that odometry collects up to each keyframe (index order): of translation and rotation.
struct Drift {
  std::vector<double> translation, rotation;
};

double mean_variance(const Eigen::Matrix3d& information) {
  // Information of a sum of independent axes; a zero axis is not odometry's to tell.
  const SymmetricEigen<3> eigen = symmetric_eigen(information);
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += 1.0 / std::max(eigen.values(i), 1e-6);
  return sum / 3;
}

Drift drift_of(const Graph& graph) {
  const std::size_t n = graph.keyframes.size();
  // Steps without odometry carry a drift that stops every comparison across them.
  std::vector<double> step_t(n, 1e6), step_r(n, 1e6);
  const auto index = [&](KeyframeId id) {
    return static_cast<std::size_t>(&graph.at(id) - graph.keyframes.data());
  };
  for (const auto& f : graph.odometry) {
    const std::size_t a = index(f.from), b = index(f.to);
    if (b != a + 1) continue;
    const Matrix6d information = f.sqrt_information.transpose() * f.sqrt_information;
    step_t[b] = mean_variance(information.topLeftCorner<3, 3>());
    step_r[b] = mean_variance(information.bottomRightCorner<3, 3>());
  }
  for (const auto& f : graph.planar_odometry) {
    const std::size_t a = index(f.from), b = index(f.to);
    if (b != a + 1) continue;
    const Eigen::Matrix3d information = f.sqrt_information.transpose() * f.sqrt_information;
    step_t[b] = 1.0 / std::max(1e-6, 0.5 * information.topLeftCorner<2, 2>().trace());
    step_r[b] = 1.0 / std::max(1e-6, information(2, 2));
  }
  Drift drift{std::vector<double>(n, 0.0), std::vector<double>(n, 0.0)};
  for (std::size_t i = 1; i < n; ++i) {
    drift.translation[i] = drift.translation[i - 1] + step_t[i];
    drift.rotation[i] = drift.rotation[i - 1] + step_r[i];
  }
  return drift;
}

struct Sighting {
  std::size_t factor, keyframe;
  Moments moments_map;
};

/// Chi-squared of the best plane through both, drift between them allowed for.
double disagreement(const Sighting& a, const Sighting& b, const Drift& drift,
                    const Eigen::Vector3d& normal_map, const Eigen::Vector3d& position_a) {
  const double rotation =
      std::sqrt(std::max(0.0, drift.rotation[b.keyframe] - drift.rotation[a.keyframe]));
  const double translation =
      std::sqrt(std::max(0.0, drift.translation[b.keyframe] - drift.translation[a.keyframe]));
  const double lever = (b.moments_map.mean() - position_a).norm();
  const NoiseFloor floor{std::hypot(translation, rotation * lever), rotation};
  if (floor.sigma_rho > kFarthestSigma) return INFINITY;
  // Tilts are discounted about the seen plane where it is known, else about the landmark's.
  const SymmetricEigen<3> own = symmetric_eigen(b.moments_map.scatter());
  const bool full = own.values(1) > 1e-6 * own.values(2);
  Moments both =
      b.moments_map.discounted(full ? Eigen::Vector3d(own.vectors.col(0)) : normal_map, floor);
  both.merge(a.moments_map);
  return symmetric_eigen(both.scatter()).values(0);
}

/// Groups of sightings that agree, and how many neighbours each was compared with.
struct Groups {
  std::vector<std::size_t> root, compared;
};

Groups groups_of(const std::vector<Sighting>& sightings, const Drift& drift, const Graph& graph,
                 const Eigen::Vector3d& normal_map, double inlier_chi2) {
  std::vector<std::size_t> parent(sightings.size()), compared(sightings.size(), 0);
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t a = 0; a < sightings.size(); ++a) {
    const Eigen::Vector3d position =
        graph.keyframes[sightings[a].keyframe].T_map_body.translation();
    const std::size_t end = std::min(sightings.size(), a + 1 + kNeighbours);
    for (std::size_t b = a + 1; b < end; ++b) {
      const double chi2 = disagreement(sightings[a], sightings[b], drift, normal_map, position);
      if (std::isinf(chi2)) break;
      ++compared[a];
      ++compared[b];
      if (!(chi2 <= inlier_chi2)) continue;
      const std::size_t i = root(a), j = root(b);
      parent[std::max(i, j)] = std::min(i, j);
    }
  }
  for (std::size_t i = 0; i < parent.size(); ++i) parent[i] = root(i);
  return {std::move(parent), std::move(compared)};
}

std::vector<std::vector<Sighting>> sightings_by_plane(const Graph& graph) {
  std::vector<std::vector<Sighting>> by_plane(graph.planes.size());
  for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
    const auto& f = graph.plane_moments[i];
    const Keyframe& keyframe = graph.at(f.keyframe);
    by_plane[static_cast<std::size_t>(&graph.at(f.plane) - graph.planes.data())].push_back(
        {i, static_cast<std::size_t>(&keyframe - graph.keyframes.data()),
         f.moments_body.transformed(keyframe.T_map_body)});
  }
  for (auto& sightings : by_plane) {
    std::stable_sort(sightings.begin(), sightings.end(),
                     [](const auto& a, const auto& b) { return a.keyframe < b.keyframe; });
  }
  return by_plane;
}

}  // namespace

Agreement agreeing_observations(const Graph& graph, double inlier_chi2) {
  const Drift drift = drift_of(graph);
  const auto by_plane = sightings_by_plane(graph);
  Agreement result;
  result.weights.assign(graph.plane_moments.size(), 1.0);
  result.in_largest.assign(graph.plane_moments.size(), false);
  for (std::size_t p = 0; p < by_plane.size(); ++p) {
    const auto& sightings = by_plane[p];
    if (sightings.empty()) continue;
    const PlaneLandmark& plane = graph.planes[p];
    const Groups groups =
        groups_of(sightings, drift, graph, plane.plane_anchor.normal(), inlier_chi2);
    std::vector<std::size_t> sizes(sightings.size(), 0);
    for (const std::size_t g : groups.root) ++sizes[g];
    const auto largest =
        static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
    for (std::size_t i = 0; i < sightings.size(); ++i) {
      if (groups.root[i] == largest) {
        result.in_largest[sightings[i].factor] = true;
      } else if (sizes[groups.root[i]] == 1) {
        result.weights[sightings[i].factor] = 0;
        if (groups.compared[i] > 0) ++result.conflicts;
      }
    }
  }
  return result;
}

}  // namespace lamina
