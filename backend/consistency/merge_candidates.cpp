// Near pairs from an index of outlines, their joint covariances from one factorisation.
#include <lamina/backend/consistency/merge_candidates.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include <lamina/backend/association/level_separation.hpp>
#include <lamina/backend/association/plane_difference.hpp>
#include <lamina/backend/association/plane_neighbourhood.hpp>
#include <lamina/backend/association/same_view_separation.hpp>
#include <lamina/backend/consistency/crossing_planes.hpp>
#include <lamina/backend/solver/covariance.hpp>
#include <lamina/models/linalg.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
// What refined poses are still wrong by among each other over the extent of one view, 1-sigma,
// whatever their covariance says: walls are no planes.
constexpr double kPoseSigma = 0.006;          // m
constexpr double kPoseTilt = 0.15 * kDegree;  // rad
constexpr double kFarApart = 5;               // times the surface's sigma
constexpr int kFewViews = 6;                  // too few to say there are two planes
constexpr double kFewShare = 0.02;            // or this share of the other plane's
constexpr double kThin = 0.03;                // m: how far such views may be off all over
constexpr double kThinAngle = 5 * kDegree;    // and turned
constexpr double kWide = 0.35;    // m: narrower, an outline's cells reach over it from both sides
constexpr double kCovered = 0.6;  // of their outline lies in the other's
constexpr double kMostOff = 0.3;  // m: one wall stands no further apart
constexpr double kSameSide = 60 * kDegree;
constexpr double kAlike = 2.0;  // chi-squared: no telling which of two fits

using Pairs = std::set<std::pair<PlaneId, PlaneId>>;

bool has(const Pairs& pairs, PlaneId a, PlaneId b) {
  return pairs.count({a, b}) > 0 || pairs.count({b, a}) > 0;
}

struct Agreement {
  double chi = std::numeric_limits<double>::infinity();
  double sigma = 0;  // m
};

Agreement agreement(const PlaneLandmark& a, const PlaneLandmark& b, const Eigen::Vector3d& middle,
                    const Matrix6d& joint, const AssociationOptions& options) {
  const auto [off, J] = gap_between(a, b, middle);
  Eigen::Matrix3d C = J * joint * J.transpose();
  C.diagonal() += surface_noise(options);
  const Eigen::LLT<Eigen::Matrix3d> llt(C);
  if (!C.allFinite() || llt.info() != Eigen::Success) return {};
  return {off.dot(llt.solve(off)), std::sqrt(C(2, 2))};
}

// Sets of planes that became one.
class Sets {
 public:
  PlaneId root(PlaneId id) const {
    for (auto it = parent_.find(id); it != parent_.end(); it = parent_.find(id)) id = it->second;
    return id;
  }
  const std::set<PlaneId>& members(PlaneId root) {
    auto& all = members_[root];
    all.insert(root);
    return all;
  }
  void join(PlaneId from, PlaneId into) {
    members(into);
    for (const PlaneId id : members(from)) members_[into].insert(id);
    members_.erase(from);
    parent_[from] = into;
  }

 private:
  std::map<PlaneId, PlaneId> parent_;
  std::map<PlaneId, std::set<PlaneId>> members_;
};

// Of the outline, m: its area over its longest extent.
double width_of(const OutlineGrid& outline) {
  Eigen::AlignedBox2d box;
  for (const auto& [i, j] : outline.cells()) {
    box.extend(outline.cell_size() * Eigen::Vector2d(i, j));
    box.extend(outline.cell_size() * Eigen::Vector2d(i + 1, j + 1));
  }
  return box.isEmpty() ? 0 : outline.area() / box.diagonal().norm();
}

// Share of `small`'s outline that lies in `large`'s, and how far from its plane at most.
struct Cover {
  double share = 0, farthest = 0;
};

Cover cover_of(const PlaneLandmark& small, std::span<const PlaneLandmark* const> large) {
  Cover cover;
  std::size_t cells = 0, inside = 0;
  std::vector<SE3> T_large_map;
  for (const PlaneLandmark* part : large) T_large_map.push_back(part->T_map_outline.inverse());
  const double cell = small.outline.cell_size();
  for (const auto& [i, j] : small.outline.cells()) {
    const Eigen::Vector3d p =
        small.T_map_outline * Eigen::Vector3d((i + 0.5) * cell, (j + 0.5) * cell, 0);
    bool in = false;
    for (std::size_t k = 0; k < large.size() && !in; ++k) {
      in = large[k]->outline.contains((T_large_map[k] * p).head<2>());
    }
    ++cells;
    inside += in ? 1 : 0;
    cover.farthest = std::max(cover.farthest, std::abs((T_large_map.front() * p).z()));
  }
  if (cells > 0) cover.share = static_cast<double>(inside) / static_cast<double>(cells);
  return cover;
}

// Each plane that goes, and the one that covers most of it.
class BestCovers {
 public:
  void offer(PlaneId from, PlaneId into, double share) {
    const auto [known, fresh] = best_.try_emplace(from, share, into);
    if (!fresh && share > known->second.first) known->second = {share, into};
  }
  /// What goes into a plane that goes itself waits.
  std::vector<std::pair<PlaneId, PlaneId>> pairs() const {
    std::vector<std::pair<PlaneId, PlaneId>> result;
    for (const auto& [from, choice] : best_) {
      if (!best_.count(choice.second)) result.emplace_back(from, choice.second);
    }
    return result;
  }

 private:
  std::map<PlaneId, std::pair<double, PlaneId>> best_;
};

// Share of `small` in `large` where what few views saw of it lies on that, as far as it is a plane.
std::optional<double> lies_on(const PlaneLandmark& small, const PlaneLandmark& large,
                              const DoubleOptions& options) {
  const Cover cover = cover_of(small, std::array{&large});
  if (!(cover.share >= kCovered)) return std::nullopt;
  if (cover.farthest <= kThin) return cover.share;
  const auto ground = options.ground_tilt.find(large.id);
  const bool swells = ground != options.ground_tilt.end() &&
                      angle_between(small.plane_anchor, large.plane_anchor) <= 2 * ground->second;
  return swells ? std::optional(cover.share) : std::nullopt;
}

struct Candidate {
  double chi;
  PlaneId from, into;
};

// Which near pairs of planes fit each other.
struct Fits {
  double gate;
  std::map<std::pair<PlaneId, PlaneId>, double> chi_of;  // of all near pairs, lower id first
  std::vector<Candidate> candidates;                     // known well enough, best first

  bool fit(PlaneId a, PlaneId b) const {
    const auto found = chi_of.find(std::minmax(a, b));
    return found == chi_of.end() || found->second <= gate;
  }
  bool fit(const std::set<PlaneId>& a, const std::set<PlaneId>& b) const {
    return std::all_of(a.begin(), a.end(), [&](PlaneId x) {
      return std::all_of(b.begin(), b.end(), [&](PlaneId y) { return fit(x, y); });
    });
  }
  // Another plane that fits `a` as well as `b` does, and is not `b`.
  bool undecided(const Candidate& c) const {
    return std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& o) {
      if (o.chi > c.chi + kAlike) return false;
      for (const auto& [one, other] : {std::pair(c.from, c.into), std::pair(c.into, c.from)}) {
        const PlaneId third = o.from == one ? o.into : o.into == one ? o.from : PlaneId::kNone;
        if (third != PlaneId::kNone && third != other && !fit(third, other)) return true;
      }
      return false;
    });
  }
};

Fits fits_of(const Graph& graph, const PlaneNeighbourhood& near, const LevelGaps& gaps,
             const Pairs& apart, const DoubleOptions& options) {
  Fits fits{options.gate, {}, {}};
  CovarianceRequest request;
  for (const auto& [a, b] : near.pairs(kSameSide)) {
    fits.chi_of[std::minmax(a, b)] = std::numeric_limits<double>::infinity();
    const PlaneLandmark &small = graph.at(a), &large = graph.at(b);
    const double angle = angle_between(small.plane_anchor, large.plane_anchor);
    const double off = large.plane_map().signed_distance(near.middle(a));
    if (has(apart, a, b) || angle > options.association.max_angle_deg * kDegree ||
        !(std::abs(off) <= kMostOff) || gaps.apart(a, b)) {
      continue;
    }
    request.plane_pairs.emplace_back(a, b);
  }
  if (request.plane_pairs.empty()) return fits;
  const Covariances known = covariances(graph, request);
  if (!known.valid) return fits;
  for (std::size_t i = 0; i < request.plane_pairs.size(); ++i) {
    const auto [a, b] = request.plane_pairs[i];
    const Agreement found = agreement(graph.at(a), graph.at(b), near.middle(a),
                                      known.plane_pairs[i], options.association);
    fits.chi_of[std::minmax(a, b)] = found.chi;
    if (found.chi > options.gate || found.sigma > options.max_sigma_m) continue;
    if (near.beside(a, b)) fits.candidates.push_back({found.chi, a, b});
  }
  std::stable_sort(fits.candidates.begin(), fits.candidates.end(),
                   [](const Candidate& x, const Candidate& y) { return x.chi < y.chi; });
  return fits;
}

}  // namespace

std::vector<std::pair<PlaneId, PlaneId>> find_doubles(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<std::pair<PlaneId, PlaneId>>& apart, const DoubleOptions& options) {
  const PlaneNeighbourhood near(graph, outlines, options.association.max_gap_m, false);
  const LevelGaps gaps(graph, outlines, options.association);
  const Fits fits = fits_of(graph, near, gaps, apart, options);
  Sets sets;
  std::vector<std::pair<PlaneId, PlaneId>> doubles;
  for (const Candidate& c : fits.candidates) {
    const PlaneId a = sets.root(c.from), b = sets.root(c.into);
    if (a == b || fits.undecided(c) || !fits.fit(sets.members(a), sets.members(b))) continue;
    const bool smaller = std::pair(near.seen(a).views, b) < std::pair(near.seen(b).views, a);
    const PlaneId from = smaller ? a : b, into = smaller ? b : a;
    sets.join(from, into);
    doubles.emplace_back(from, into);
  }
  return doubles;
}

std::vector<std::pair<PlaneId, PlaneId>> find_slivers(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<std::pair<PlaneId, PlaneId>>& apart, const DoubleOptions& options) {
  const PlaneNeighbourhood near(graph, outlines, options.association.max_gap_m, false);
  const LevelGaps gaps(graph, outlines, options.association);
  BestCovers best;
  for (const auto& [a, b] : near.pairs(kThinAngle)) {
    if (has(apart, a, b)) continue;
    const int views = near.seen(a).views;
    if (views > std::max<double>(kFewViews, kFewShare * near.seen(b).views)) continue;
    const PlaneLandmark &small = graph.at(a), &large = graph.at(b);
    if (std::abs(large.plane_map().signed_distance(near.middle(a))) > kThin) continue;
    const auto cover = lies_on(small, large, options);
    if (!cover || gaps.step(a, b)) continue;
    best.offer(a, b, *cover);
  }
  return best.pairs();
}

std::vector<std::pair<PlaneId, PlaneId>> find_seen_through(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<std::pair<PlaneId, PlaneId>>& apart, const DoubleOptions& options) {
  const PlaneNeighbourhood near(graph, outlines, options.association.max_gap_m, false);
  const SameViewSeparation views(graph, options.association, options.gate);
  struct Near {
    PlaneId small, large;
    double off;  // m
  };
  const LevelGaps gaps(graph, outlines, options.association);
  std::vector<Near> candidates;
  std::map<PlaneId, double> nearest_other;  // m: to a plane that it is told apart from
  for (const auto& [a, b] : near.pairs(options.association.max_angle_deg * kDegree)) {
    const PlaneLandmark &small = graph.at(a), &large = graph.at(b);
    const double off = std::abs(large.plane_map().signed_distance(near.middle(a)));
    if (!(off <= kMostOff) || width_of(small.outline) < kWide) continue;
    if (views.separated(a, b) || gaps.step(a, b)) {
      for (const PlaneId id : {a, b}) {
        const auto known = nearest_other.emplace(id, off).first;
        known->second = std::min(known->second, off);
      }
    } else if (!has(apart, a, b)) {
      candidates.push_back({a, b, off});
    }
  }
  BestCovers best;
  for (const auto& [a, b, off] : candidates) {
    const auto farther = [&, d = off](PlaneId id) {
      const auto other = nearest_other.find(id);
      return other != nearest_other.end() && d >= other->second;
    };
    if (farther(a) || farther(b)) continue;
    const Cover cover = cover_of(graph.at(a), std::array{&graph.at(b)});
    if (cover.share >= kCovered) best.offer(a, b, cover.share);
  }
  return best.pairs();
}

namespace {

// Covariance of the plane's (tilt, tilt, rho) about `middle_map` by its own evidence alone.
Eigen::Matrix3d own_covariance(const PlaneLandmark& plane, const Moments& m,
                               const Eigen::Vector3d& middle_map, double prior_tilt) {
  const Matrix32d B = plane.plane_anchor.tangent_basis();
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  H.topLeftCorner<2, 2>() = B.transpose() * m.scatter() * B;
  Eigen::Vector3d along;
  along << B.transpose() * m.mean(), -1;
  H += m.weight() * along * along.transpose();
  const double tilt = 1 / (prior_tilt * prior_tilt);
  H.diagonal() += Eigen::Vector3d(tilt, tilt, 1e-6);
  const Eigen::Matrix3d J = about_middle(plane, middle_map, B);
  return J * H.llt().solve(Eigen::Matrix3d::Identity()) * J.transpose();
}

struct LineFit {
  const Graph& graph;
  const PlaneNeighbourhood& near;
  double prior_tilt;
  const DoubleOptions& options;

  // How well `a` fits `b`: chi-squared, the gate where it does not.
  double chi(PlaneId a, PlaneId b) const {
    const PlaneLandmark &small = graph.at(a), &large = graph.at(b);
    const bool turned = angle_between(small.plane_anchor, large.plane_anchor) > kThinAngle;
    const Eigen::Vector3d middle = near.middle(a);
    const Eigen::Vector3d off =
        small.plane_map().about(middle).boxminus(large.plane_map().about(middle));
    double chi = turned ? options.gate : own_chi(a, b, middle, off);
    // However unsure, planes this far apart are not made one: a slab lies on its floor.
    if (std::abs(off.z()) > kFarApart * options.association.surface_sigma_m) chi = options.gate;
    if (chi < options.gate) return chi;
    std::vector<const PlaneLandmark*> parts;
    for (const PlaneId id : near.members(b)) parts.push_back(&graph.at(id));
    if (!cross(small, parts)) {
      const int views = near.seen(a).views, others = near.seen(b).views;
      const bool few = views <= std::max<double>(kFewViews, kFewShare * others);
      if (turned || !few || std::abs(off.z()) > kThin) return options.gate;
      const Cover cover = cover_of(small, parts);
      if (cover.share < kCovered || cover.farthest > kThin) return options.gate;
    }
    return options.gate * (1 - 1e-6);
  }

 private:
  double own_chi(PlaneId a, PlaneId b, const Eigen::Vector3d& middle,
                 const Eigen::Vector3d& off) const {
    const double tilt = std::hypot(options.association.surface_sigma_deg * kDegree, kPoseTilt);
    const double rho = std::hypot(options.association.surface_sigma_m, kPoseSigma);
    Eigen::Matrix3d C = own_covariance(graph.at(a), near.seen(a).anchor, middle, prior_tilt) +
                        own_covariance(graph.at(b), near.seen(b).anchor, middle, prior_tilt);
    C.diagonal() += Eigen::Vector3d(tilt * tilt, tilt * tilt, rho * rho);
    return off.dot(C.llt().solve(off));
  }
};

}  // namespace

std::vector<std::pair<PlaneId, PlaneId>> find_line_doubles(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    double prior_tilt, const DoubleOptions& options) {
  PlaneNeighbourhood near(graph, outlines, options.association.max_gap_m, true);
  const LineFit fit{graph, near, prior_tilt, options};
  std::vector<std::pair<PlaneId, PlaneId>> doubles;
  for (const PlaneId a : near.smallest_first()) {
    const int views = near.seen(a).views;
    PlaneId best = PlaneId::kNone;
    double best_chi = options.gate;
    for (const PlaneId b : near.around(a)) {
      const int others = near.seen(b).views;
      if (others < views || (others == views && b > a)) continue;
      const double chi = fit.chi(a, b);
      if (chi >= best_chi) continue;
      best_chi = chi;
      best = b;
    }
    if (best == PlaneId::kNone) continue;
    near.join(a, best);
    doubles.emplace_back(a, best);
  }
  return doubles;
}

}  // namespace lamina
