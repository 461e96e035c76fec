// Far pairs first, then what was looked through between them, then their joint covariances.
#include <lamina/backend/consistency/occluded_duplicates.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/backend/association/line_of_sight.hpp>
#include <lamina/backend/association/outline_gap.hpp>
#include <lamina/backend/association/plane_difference.hpp>
#include <lamina/backend/association/plane_neighbourhood.hpp>
#include <lamina/backend/solver/covariance.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kNearest = 0.3, kFarthest = 2.5;  // m in plan between two pieces
constexpr double kMostOff = 0.3;                   // m: one wall stands no further apart
constexpr double kOneStorey = 0.5;                 // m in height between them
constexpr double kOpen = 0.1;  // share of what lies between that was looked through, at most

using Pair = std::pair<PlaneId, PlaneId>;

// What lies between two outlines, in plan, and how far each of them reaches that way (m).
struct Between {
  Eigen::Vector2d a = Eigen::Vector2d::Zero(), b = Eigen::Vector2d::Zero();
  double reach_a = 0, reach_b = 0;
  double height = 0;  // that one of them ends above or below the other
  double length() const { return (b - a).norm(); }
};

double extent(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector2d& direction) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& p : points) {
    low = std::min(low, direction.dot(p.head<2>()));
    high = std::max(high, direction.dot(p.head<2>()));
  }
  return high - low;
}

// Between the lowest of the one and the highest of the other, 0 where both are at one height.
double height_between(const std::vector<Eigen::Vector3d>& a,
                      const std::vector<Eigen::Vector3d>& b) {
  const auto lower = [](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
    return p.z() < q.z();
  };
  if (a.empty() || b.empty()) return 0;
  const auto [low_a, high_a] = std::minmax_element(a.begin(), a.end(), lower);
  const auto [low_b, high_b] = std::minmax_element(b.begin(), b.end(), lower);
  return std::max({0.0, low_a->z() - high_b->z(), low_b->z() - high_a->z()});
}

Between between(const PlaneLandmark& a, const PlaneLandmark& b) {
  const std::vector<Eigen::Vector3d> of_a = seen_points_map(a), of_b = seen_points_map(b);
  Between result;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& p : of_a) {
    for (const auto& q : of_b) {
      const double squared = (p - q).head<2>().squaredNorm();
      if (squared >= least) continue;
      least = squared;
      result.a = p.head<2>(), result.b = q.head<2>();
    }
  }
  result.height = height_between(of_a, of_b);
  const Eigen::Vector2d direction = (result.b - result.a).normalized();
  result.reach_a = extent(of_a, direction), result.reach_b = extent(of_b, direction);
  return result;
}

struct HiddenPairs {
  std::vector<Pair> pairs;
  std::vector<SightGap> gaps;  // what lies between the two of each pair
};

// Upright planes in line with each other, further apart than find_doubles() goes.
HiddenPairs in_line(const Graph& graph,
                    const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
                    const PlaneNeighbourhood& near, const std::set<Pair>& apart,
                    const AssociationOptions& options) {
  const PlaneNeighbourhood nearer(graph, outlines, options.max_gap_m, false);
  HiddenPairs result;
  for (const auto& [a, b] : near.pairs(options.max_angle_deg * kDegree)) {
    const PlaneLandmark &small = graph.at(a), &large = graph.at(b);
    if (apart.count({a, b}) || apart.count({b, a})) continue;
    if (std::abs(small.plane_anchor.normal().z()) > kUprightNormal ||
        std::abs(large.plane_anchor.normal().z()) > kUprightNormal ||
        !(std::abs(large.plane_map().signed_distance(near.middle(a))) <= kMostOff)) {
      continue;
    }
    const Between gap = between(small, large);
    const double length = gap.length();
    if (!(length >= kNearest && length <= kFarthest)) continue;
    if (length > 2 * std::min(gap.reach_a, gap.reach_b) || gap.height > kOneStorey) continue;
    if (nearer.beside(a, b)) continue;  // find_doubles()
    result.pairs.emplace_back(a, b);
    result.gaps.emplace_back(gap.a, gap.b);
  }
  return result;
}

// Those of the pairs that are one plane by their joint covariance, best first.
std::vector<Pair> agreeing(const Graph& graph, const PlaneNeighbourhood& near,
                           const CovarianceRequest& request, const DoubleOptions& options) {
  const Covariances known = covariances(graph, request);
  if (!known.valid) return {};
  std::vector<std::pair<double, Pair>> found;
  for (std::size_t i = 0; i < request.plane_pairs.size(); ++i) {
    const auto [a, b] = request.plane_pairs[i];
    const PlaneGap gap = gap_between(graph.at(a), graph.at(b), near.middle(a));
    Eigen::Matrix3d C = gap.J * known.plane_pairs[i] * gap.J.transpose();
    C.diagonal() += surface_noise(options.association);
    const Eigen::LLT<Eigen::Matrix3d> llt(C);
    if (!C.allFinite() || llt.info() != Eigen::Success) continue;
    const double chi = gap.off.dot(llt.solve(gap.off));
    if (chi <= options.gate && std::sqrt(C(2, 2)) <= options.max_sigma_m)
      found.push_back({chi, {a, b}});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& x, const auto& y) { return x.first < y.first; });
  std::vector<Pair> pairs;
  for (const auto& [chi, pair] : found) pairs.push_back(pair);
  return pairs;
}

}  // namespace

std::vector<Pair> find_occluded_duplicates(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<Pair>& apart, const DoubleOptions& options) {
  const PlaneNeighbourhood near(graph, outlines, kFarthest, false);
  auto [pairs, gaps] = in_line(graph, outlines, near, apart, options.association);
  if (pairs.empty()) return {};
  look_through(graph, outlines, gaps);
  CovarianceRequest request;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (gaps[i].open() <= kOpen) request.plane_pairs.push_back(pairs[i]);
  }
  if (request.plane_pairs.empty()) return {};
  std::set<PlaneId> taken;
  std::vector<Pair> doubles;
  for (const Pair& pair : agreeing(graph, near, request, options)) {
    if (taken.count(pair.first) || taken.count(pair.second)) continue;
    taken.insert({pair.first, pair.second});
    doubles.push_back(pair);
  }
  return doubles;
}

}  // namespace lamina
