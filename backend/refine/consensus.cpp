// Pairwise agreement of a plane's observations within what odometry can tell.
#include <lamina/backend/refine/consensus.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include <lamina/backend/graph/factors/of_sensor.hpp>
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
  Eigen::Vector3d normal_map;  ///< of its own plane, either side
  bool full;                   ///< it shows one

  Sighting(std::size_t of_factor, std::size_t of_keyframe, const Moments& seen)
      : factor(of_factor), keyframe(of_keyframe), moments_map(seen) {
    const SymmetricEigen<3> own = symmetric_eigen(moments_map.scatter());
    normal_map = own.vectors.col(0);
    full = own.values(1) > 1e-6 * own.values(2);
  }
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
  Moments both = b.moments_map.discounted(b.full ? b.normal_map : normal_map, floor);
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
        Sighting(i, static_cast<std::size_t>(&keyframe - graph.keyframes.data()),
                 f.moments_body.transformed(keyframe.T_map_body)));
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

namespace {

bool is_full(const Moments& moments) {
  const SymmetricEigen<3> eigen = symmetric_eigen(moments.scatter());
  return eigen.values(1) > 1e-6 * eigen.values(2);
}

/// A full view in the map, and the side it was seen from.
struct View {
  Sighting sighting;
  Eigen::Vector3d normal_map, position_map;
};

std::vector<View> full_views(const Graph& graph) {
  std::vector<View> views;
  for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
    const auto& f = graph.plane_moments[i];
    if (!is_full(f.moments_body)) continue;
    const Keyframe& keyframe = graph.at(f.keyframe);
    View view{Sighting(i, static_cast<std::size_t>(&keyframe - graph.keyframes.data()),
                       f.moments_body.transformed(keyframe.T_map_body)),
              {},
              keyframe.T_map_body.translation()};
    const Moments& moments = view.sighting.moments_map;
    view.normal_map = view.sighting.normal_map;
    if (view.normal_map.dot(view.position_map - moments.mean()) < 0) view.normal_map *= -1;
    views.push_back(view);
  }
  std::stable_sort(views.begin(), views.end(), [](const View& a, const View& b) {
    return a.sighting.keyframe < b.sighting.keyframe;
  });
  return views;
}

/// Numbers sets of two and more from 0, in the order of their first view.
Tracks numbered(const std::vector<View>& views, std::vector<std::size_t> root,
                std::size_t factors) {
  Tracks tracks;
  tracks.track.assign(factors, Tracks::kNone);
  std::vector<int> size(views.size(), 0), number(views.size(), Tracks::kNone);
  for (const std::size_t r : root) ++size[r];
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::size_t r = root[i];
    if (size[r] < 2) continue;
    if (number[r] == Tracks::kNone) number[r] = tracks.count++;
    tracks.track[views[i].sighting.factor] = number[r];
  }
  return tracks;
}

/// Half the width of what was seen, along u: of points spread evenly, sqrt(3) standard deviations.
double half_width(const Moments& moments, const Eigen::Vector3d& u) {
  return std::sqrt(3 * u.dot(moments.scatter() * u) / moments.weight());
}

/// Pieces of one plane that are no further apart than either is wide may be one surface; walls of
/// two rooms that happen to stand in line are not.
bool near_each_other(const Moments& a, const Moments& b) {
  const Eigen::Vector3d d = b.mean() - a.mean();
  const double distance = d.norm();
  if (!(distance > 0)) return true;
  const double width_a = half_width(a, d / distance), width_b = half_width(b, d / distance);
  return distance <= width_a + width_b + 2 * std::min(width_a, width_b);
}

}  // namespace

Tracks geometric_tracks(const Graph& graph, double inlier_chi2) {
  constexpr std::size_t kKeyframesAhead = 4;
  constexpr double kSameSide = 0.8;  // cosine; the chi-squared decides, this only spares its cost
  const Drift drift = drift_of(graph);
  const std::vector<View> views = full_views(graph);
  std::vector<std::size_t> parent(views.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t a = 0; a < views.size(); ++a) {
    const View& first = views[a];
    for (std::size_t b = a + 1; b < views.size(); ++b) {
      const View& second = views[b];
      if (second.sighting.keyframe > first.sighting.keyframe + kKeyframesAhead) break;
      if (second.sighting.keyframe == first.sighting.keyframe) continue;
      if (!(first.normal_map.dot(second.normal_map) > kSameSide)) continue;
      if (!near_each_other(first.sighting.moments_map, second.sighting.moments_map)) continue;
      const double chi2 = disagreement(first.sighting, second.sighting, drift, second.normal_map,
                                       first.position_map);
      if (!(chi2 <= inlier_chi2)) continue;
      const std::size_t i = root(a), j = root(b);
      parent[std::max(i, j)] = std::min(i, j);
    }
  }
  for (std::size_t i = 0; i < parent.size(); ++i) parent[i] = root(i);
  return numbered(views, std::move(parent), graph.plane_moments.size());
}

Agreement agreement_of(const Graph& graph, const Tracks& tracks) {
  const std::size_t factors = graph.plane_moments.size();
  std::map<std::pair<int, PlaneId>, std::size_t> votes;  // of a name in a track
  std::vector<std::size_t> most(static_cast<std::size_t>(tracks.count), 0);
  for (std::size_t i = 0; i < factors; ++i) {
    const int t = tracks.track[i];
    if (t == Tracks::kNone) continue;
    std::size_t& top = most[static_cast<std::size_t>(t)];
    top = std::max(top, ++votes[{t, graph.plane_moments[i].plane}]);
  }
  std::map<PlaneId, std::pair<std::size_t, int>> largest;  // votes, track
  for (const auto& [key, n] : votes) {
    auto& best = largest[key.second];
    if (n > best.first) best = {n, key.first};
  }
  Agreement result;
  result.weights.assign(factors, 0.0);
  result.in_largest.assign(factors, false);
  for (std::size_t i = 0; i < factors; ++i) {
    const auto& f = graph.plane_moments[i];
    const int t = tracks.track[i];
    if (t == Tracks::kNone) {
      result.weights[i] = result.in_largest[i] = !is_full(f.moments_body);
      continue;
    }
    const std::size_t n = votes[{t, f.plane}];
    if (n < 2 || 3 * n < 2 * most[static_cast<std::size_t>(t)]) continue;
    result.weights[i] = 1;
    result.in_largest[i] = largest[f.plane].second == t;
  }
  return result;
}

std::vector<PlaneId> names_of_tracks(const Graph& graph, const Tracks& tracks, double limit) {
  std::vector<std::vector<std::size_t>> views(static_cast<std::size_t>(tracks.count));
  for (std::size_t i = 0; i < tracks.track.size(); ++i) {
    if (tracks.track[i] == Tracks::kNone) continue;
    views[static_cast<std::size_t>(tracks.track[i])].push_back(i);
  }
  std::vector<PlaneId> names;
  for (const auto& track : views) {
    PlaneId best = PlaneId::kNone;
    double least = 0.5 * limit * static_cast<double>(track.size());
    std::set<PlaneId> carried;
    for (const std::size_t i : track) carried.insert(graph.plane_moments[i].plane);
    for (const PlaneId name : carried) {
      double sum = 0;
      for (const std::size_t i : track) {
        sum += std::min(limit, chi_squared(graph, graph.plane_moments[i], graph.at(name)));
      }
      if (sum < least) {
        least = sum;
        best = name;
      }
    }
    names.push_back(best);
  }
  return names;
}

}  // namespace lamina
