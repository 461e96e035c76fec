// Two layers of a search: surfaces along the most common direction, and those across it.
#include <lamina/frontend/loops/perceptual_aliasing.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include <lamina/frontend/motion/point_samples.hpp>

namespace lamina {
namespace {

constexpr double kResolution = 0.1;  // m
constexpr int kLevels = 7;
constexpr double kWidestTurn = 0.3;   // rad
constexpr std::size_t kFewest = 8;    // points across
constexpr double kMostWeight = 20;    // of one of them: fewer than one in twenty stay weak
constexpr std::size_t kEnough = 200;  // points along
constexpr double kAcross = 0.7071;    // |cosine| to the axis, beyond which a surface is across
constexpr double kBoth = 0.26;        // a map point within this of it is of both

// The direction that fewest surfaces face.
Eigen::Vector2d rare_direction(const std::vector<OrientedPoint>& points) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (const OrientedPoint& p : points) sum += p.normal * p.normal.transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(sum).eigenvectors().col(0);
}

// Of the points that the map's scans show at a place, how many they show at least at another, as
// far along the axis as the window goes. Up to 1.
double least_shown(const std::vector<SightFan>& fans, const std::vector<OrientedPoint>& points,
                   const PlanarPose& start, const SearchWindow& window,
                   const Eigen::Vector2d& axis_map) {
  constexpr double kMargin = 0.25;  // m
  const auto shown = [&](const PlanarPose& T) {
    const FanAgreement seen = agreement(fans, points, T, kMargin);
    return static_cast<double>(seen.agree + seen.contradict);
  };
  double least = shown(*window.exclude);
  if (!(least > 0)) return 0;
  const double here = least;
  for (const double part : {-1.0, -0.5, 0.5, 1.0}) {
    const Eigen::Vector2d at = start.translation() + part * window.translation * axis_map;
    least = std::min(least, shown({at.x(), at.y(), start.yaw}));
  }
  return least / here;
}

}  // namespace

bool look_alike_elsewhere(const std::vector<OrientedPoint>& map, const std::vector<SightFan>& fans,
                          const std::vector<OrientedPoint>& points, const PlanarPose& start,
                          const SearchWindow& window, double ratio) {
  if (!window.exclude || window.rotation > kWidestTurn) return true;
  const Eigen::Vector2d axis = rare_direction(points);
  const Eigen::Vector2d axis_map = window.exclude->rotation() * axis;
  std::vector<OrientedPoint> along, across;
  for (const OrientedPoint& p : points) {
    if (p.oriented()) (std::abs(p.normal.dot(axis)) > kAcross ? across : along).push_back(p);
  }
  across = thinned(across, kResolution);
  along = sample(std::move(along), kEnough);
  if (across.size() < kFewest || along.empty()) return true;
  ratio *= least_shown(fans, along, start, window, axis_map);
  if (!(ratio > 0)) return true;
  std::vector<Eigen::Vector2d> map_along, map_across;
  for (const OrientedPoint& p : map) {
    const double c = std::abs(p.normal.dot(axis_map));
    if (!p.oriented() || c > kAcross - kBoth) map_across.push_back(p.point);
    if (!p.oriented() || c < kAcross + kBoth) map_along.push_back(p.point);
  }
  const LikelihoodGrid grid_along(map_along, kResolution, kResolution, kLevels);
  const LikelihoodGrid grid_across(map_across, kResolution, kResolution, kLevels);
  const double share = static_cast<double>(along.size()) / static_cast<double>(across.size());
  const std::vector<SearchLayer> layers{
      {&grid_along, positions(along), 1},
      {&grid_across, positions(across), static_cast<int>(std::clamp(share, 1.0, kMostWeight))}};
  SearchWindow about;
  about.translation = 2 * kResolution;
  about.rotation = 0.05;
  const auto here = search_correlative(layers, *window.exclude, about, 0.1);
  return !here || search_correlative(layers, start, window, ratio * here->score).has_value();
}

}  // namespace lamina
