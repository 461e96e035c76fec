// Submaps as they are completed, candidates by drift, matches by search, refinement and votes.
#include <lamina/frontend/loops/loop_closer.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include <lamina/frontend/loops/submap_pair.hpp>
#include <lamina/frontend/motion/point_samples.hpp>

namespace lamina {
namespace {

constexpr std::uint64_t kLeastPoints = 20;  // a submap of no more tells nothing

std::vector<Eigen::Vector2d> search_points(const std::vector<OrientedPoint>& points, int most) {
  return positions(sample(points, static_cast<std::size_t>(std::max(0, most))));
}

SearchWindow search_window(const Eigen::Matrix3d& C, const LoopCloserOptions& options) {
  SearchWindow window;
  window.translation = std::clamp(options.gate_sigmas * std::sqrt(std::max(C(0, 0), C(1, 1))),
                                  options.min_window, options.max_window);
  window.rotation = std::clamp(options.gate_sigmas * std::sqrt(C(2, 2)), options.min_window_yaw,
                               options.max_window_yaw);
  return window;
}

Eigen::Matrix3d match_covariance(const LineMatch& match, const LoopCloserOptions& options) {
  Eigen::Matrix3d R = match.information.inverse();
  R.diagonal() +=
      Eigen::Vector3d(options.sigma_translation, options.sigma_translation, options.sigma_rotation)
          .cwiseAbs2();
  return R;
}

}  // namespace

LoopCloser::LoopCloser(const LoopCloserOptions& options) : options_(options) {}

void LoopCloser::start_submap(Timestamp stamp) {
  const PlanarPose T_map_anchor =
      submaps_.empty() ? PlanarPose{}
                       : graph_.pose(static_cast<int>(submaps_.size()) - 1) * T_anchor_body_;
  if (!submaps_.empty()) store_.add(std::exchange(newest_, {}));
  Submap submap;
  submap.stamp = stamp;
  submaps_.push_back(std::move(submap));
  graph_.add_node(T_map_anchor);
  T_anchor_body_ = {};
  key_scans_ = 0;
  ++counts_.submaps;
}

std::vector<LoopClosure> LoopCloser::add(const LaserScan& scan, const ScanMotion& motion) {
  std::vector<LoopClosure> loops;
  if (submaps_.empty()) {
    start_submap(scan.stamp);
  } else {
    Submap& submap = submaps_.back();
    const PlanarPose step = planar_part(motion.T_prev_curr_body);
    const Eigen::Matrix3d Ad = step.inverse().adjoint();
    submap.covariance = Ad * submap.covariance * Ad.transpose() + planar_block(motion.covariance);
    submap.travelled += std::hypot(step.x, step.y);
    submap.turned += std::abs(step.yaw);
    T_anchor_body_ = T_anchor_body_ * step;
    if (submap.travelled > options_.submap_length || submap.turned > options_.submap_turn) {
      loops = complete_submap();
      start_submap(scan.stamp);
      PlanarEdge edge;
      edge.to = static_cast<int>(submaps_.size()) - 1;
      edge.from = edge.to - 1;
      const Submap& before = submaps_[static_cast<std::size_t>(edge.from)];
      edge.T_from_to = before.T_anchor_end;
      edge.information = before.covariance.inverse();
      graph_.add_edge(edge);
      pass(edge.from);
    }
  }
  const Submap& submap = submaps_.back();
  if (options_.keep_path) {
    scans_.push_back({scan.stamp, static_cast<int>(submaps_.size()) - 1, T_anchor_body_,
                      submap.travelled + submap.turned});
  }
  extend_submap(scan);
  return loops;
}

void LoopCloser::extend_submap(const LaserScan& scan) {
  const Eigen::Vector3d d = difference(T_anchor_key_, T_anchor_body_);
  if (key_scans_ > 0 && d.head<2>().norm() < options_.key_translation &&
      std::abs(d.z()) < options_.key_rotation) {
    return;
  }
  ScanPointOptions point_options;
  point_options.max_range = options_.max_range;
  const Eigen::Vector2d scanner = scan.lidar.T_body_lidar.translation().head<2>();
  const auto points = without_lone(oriented_points(scan, point_options), scanner);
  if (points.empty()) return;
  Submap& submap = submaps_.back();
  const auto moved = transformed(points, T_anchor_body_);
  newest_.points.insert(newest_.points.end(), moved.begin(), moved.end());
  newest_.fans.push_back(sight_fan(points, scanner, T_anchor_body_));
  T_anchor_key_ = T_anchor_body_;
  ++key_scans_;
  submap.centre += (T_anchor_body_.translation() - submap.centre) / key_scans_;
}

std::vector<LoopClosure> LoopCloser::complete_submap() {
  Submap& submap = submaps_.back();
  submap.T_anchor_end = T_anchor_body_;
  newest_.points = thinned(newest_.points, options_.thin_cell);
  newest_.points.shrink_to_fit();
  newest_.fans.shrink_to_fit();
  submap.points = newest_.points.size();
  // A submap that came about in one place has had no step: its covariance must still invert.
  submap.covariance.diagonal() += Eigen::Vector3d(1e-8, 1e-8, 1e-8);
  return close(static_cast<int>(submaps_.size()) - 1);
}

std::vector<LoopCloser::Candidate> LoopCloser::candidates(int submap) const {
  const Submap& q = submaps_[static_cast<std::size_t>(submap)];
  const Eigen::Vector2d centre = graph_.pose(submap) * q.centre;
  std::vector<int> olds;
  for (int i = 0; i + options_.min_gap < submap; ++i) {
    const Submap& old = submaps_[static_cast<std::size_t>(i)];
    if (old.points > kLeastPoints) olds.push_back(i);
  }
  const auto covariances = graph_.relative_covariances(olds, submap);
  std::vector<Candidate> all;
  for (std::size_t k = 0; k < olds.size(); ++k) {
    const Submap& old = submaps_[static_cast<std::size_t>(olds[k])];
    const double distance = (graph_.pose(olds[k]) * old.centre - centre).norm();
    const Eigen::Matrix3d& C = covariances[k];
    const double sigma = std::sqrt(std::max(C(0, 0), C(1, 1)));
    if (distance > options_.overlap_distance + options_.gate_sigmas * sigma) continue;
    all.push_back({olds[k], graph_.pose(olds[k]).inverse() * graph_.pose(submap), C,
                   distance + options_.gate_sigmas * sigma});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Candidate& a, const Candidate& b) { return a.farthest < b.farthest; });
  // Neighbours along the way are one candidate.
  std::vector<Candidate> kept;
  for (const Candidate& c : all) {
    const bool near = std::any_of(kept.begin(), kept.end(), [&](const Candidate& k) {
      return std::abs(k.submap - c.submap) <= 2;
    });
    if (!near) kept.push_back(c);
    if (static_cast<int>(kept.size()) == options_.max_candidates) break;
  }
  return kept;
}

LikelihoodGrid LoopCloser::search_grid(const std::vector<OrientedPoint>& points) const {
  return LikelihoodGrid(positions(points), options_.resolution, options_.resolution, 7);
}

// The grid does not depend on the order of the points.
void LoopCloser::remake_grids() {
  for (OldMap& map : cache_) map.grid = search_grid(map.points.points());
}

const LoopCloser::OldMap& LoopCloser::old_map(int submap, int newer) {
  for (const OldMap& map : cache_) {
    if (map.submap == submap) return map;
  }
  OldMap map;
  map.submap = submap;
  std::vector<OrientedPoint> points;
  for (int i = std::max(0, submap - 1); i <= submap + 1 && i + 1 < newer; ++i) {
    SubmapViews part = store_.views(static_cast<std::size_t>(i));
    const PlanarPose T = graph_.pose(submap).inverse() * graph_.pose(i);
    const auto moved = transformed(part.points, T);
    points.insert(points.end(), moved.begin(), moved.end());
    for (SightFan& fan : part.fans) {
      fan.T_anchor_scanner = T * fan.T_anchor_scanner;
      map.fans.push_back(std::move(fan));
    }
  }
  points = thinned(points, options_.thin_cell);
  map.grid = search_grid(points);
  map.points = PointMap(std::move(points));
  cache_.push_back(std::move(map));
  // Where memory counts, those of one submap's candidates: the next one, on its way, has others.
  const int most = options_.visits > 0 ? std::max(1, options_.max_candidates) : 12;
  if (cache_.size() > static_cast<std::size_t>(most)) cache_.pop_front();
  return cache_.back();
}

std::optional<PlanarEdge> LoopCloser::match(const Candidate& candidate, int submap, double& score) {
  const OldMap& old = old_map(candidate.submap, submap);
  ++counts_.tried;
  const SubmapPair pair{old.points, old.fans, newest_};
  SearchWindow window = search_window(candidate.covariance, options_);
  const auto points = search_points(newest_.points, options_.search_points);
  const auto best =
      search_correlative(old.grid, points, candidate.T_old_new, window, options_.min_score);
  if (!best) return std::nullopt;
  ++counts_.found;
  window.exclude = best->T_map_scan;
  if (search_correlative(old.grid, points, candidate.T_old_new, window,
                         options_.max_ambiguity * best->score) &&
      pair.ambiguous(candidate.T_old_new, window, options_.max_ambiguity)) {
    ++counts_.ambiguous;
    return std::nullopt;
  }
  const LineMatch refined = pair.align(best->T_map_scan);
  if (refined.matched < options_.min_matched) {
    ++counts_.unmatched;
    return std::nullopt;
  }
  if (refined.unknown_directions > 0) {
    ++counts_.open_direction;
    return std::nullopt;
  }
  if (pair.agreement_ratio(refined.T_map_scan, options_.agreement_margin) <
      options_.min_agreement) {
    ++counts_.contradicted;
    return std::nullopt;
  }
  score = refined.matched;
  const PlanarEstimate found{refined.T_map_scan, match_covariance(refined, options_)};
  if (!pair.consistent({candidate.T_old_new, candidate.covariance}, found,
                       options_.max_chi_squared)) {
    ++counts_.inconsistent;
    return std::nullopt;
  }
  return PlanarEdge{candidate.submap, submap, found.pose, found.covariance.inverse(), true};
}

bool LoopCloser::accept(const PlanarEdge& edge) {
  const std::vector<PlanarPose> before = graph_.poses();
  graph_.add_edge(edge);
  graph_.optimise();
  if (graph_.chi_squared(edge) <= options_.max_chi_squared) {
    ++counts_.accepted;
    return true;
  }
  graph_.remove_last_edge();
  graph_.poses() = before;
  ++counts_.inconsistent;
  return false;
}

std::vector<LoopClosure> LoopCloser::close(int submap) {
  std::vector<LoopClosure> loops;
  if (newest_.points.size() <= kLeastPoints) {
    if (options_.visits > 0) let_go(submap);
    return loops;
  }
  for (const Candidate& candidate : candidates(submap)) {
    double score = 0;
    const auto edge = match(candidate, submap, score);
    if (edge && accept(*edge)) loops.push_back(lifted_loop(*edge, score));
  }
  if (options_.visits > 0 && known_well(submap, loops.empty() ? 2 : 1)) let_go(submap);
  return loops;
}

void LoopCloser::let_go(int submap) {
  submaps_[static_cast<std::size_t>(submap)].points = 0;
  newest_ = SubmapViews();
}

// As many older submaps as are kept, `times` over, look at this place the same way.
bool LoopCloser::known_well(int submap, int times) const {
  constexpr double kSameHeading = 0.5;  // rad
  const Eigen::Vector2d centre =
      graph_.pose(submap) * submaps_[static_cast<std::size_t>(submap)].centre;
  std::vector<int> known;
  for (int i = 0; i + options_.min_gap < submap; ++i) {
    const Submap& old = submaps_[static_cast<std::size_t>(i)];
    if (old.points <= kLeastPoints) continue;
    const double off = (graph_.pose(i) * old.centre - centre).norm();
    const double turn = std::abs((graph_.pose(i).inverse() * graph_.pose(submap)).yaw);
    if (off < options_.submap_length / 2 && turn < kSameHeading) known.push_back(i);
  }
  if (static_cast<int>(known.size()) < times * options_.visits) return false;
  if (times == 1) return true;  // a match says where it is
  const double most = options_.submap_length / 2;
  const auto covariances = graph_.relative_covariances(known, submap);
  return std::all_of(covariances.begin(), covariances.end(), [most](const Eigen::Matrix3d& C) {
    return std::max(C(0, 0), C(1, 1)) < most * most;
  });
}

// A submap that was let go needs no node: the graph is as large as the place then, not as the way.
// One that matched nothing is an edge from the node before it to the next one, exactly. One that
// matched leaves the next one hung on the submap that it matched, where all that was known of it
// has it, and as surely as that match and the way since say; the way there told something of the
// node before it, though, where that is a kept one (`free_way_` false), and it stays.
void LoopCloser::pass(int submap) {
  constexpr double kDoubtful = 9;  // chi-squared of a match, 3 dof
  if (options_.visits <= 0 || options_.keep_path) return;
  const bool kept = submap == 0 || submaps_[static_cast<std::size_t>(submap)].points > 0;
  if (kept) {
    free_way_ = false;
    return;
  }
  const PlanarEdge out = graph_.edges().back();
  const PlanarEdge *in = nullptr, *match = nullptr;
  for (const PlanarEdge& e : graph_.edges()) {
    if (e.to != submap) continue;
    if (!e.robust) {
      in = &e;
    } else if (!match || e.information.determinant() > match->information.determinant()) {
      match = &e;
    }
  }
  if (in == nullptr) return;
  if (match && (!free_way_ || graph_.chi_squared(*match) > kDoubtful)) {
    free_way_ = true;
    return;
  }
  const PlanarEdge& by = match ? *match : *in;
  const Eigen::Matrix3d Ad = out.T_from_to.inverse().adjoint();
  PlanarEdge passing;
  passing.from = by.from;
  passing.to = out.to;
  passing.T_from_to =
      (match ? graph_.pose(by.from).inverse() * graph_.pose(submap) : by.T_from_to) * out.T_from_to;
  passing.information = (Ad * (graph_.weight(by) * by.information).inverse() * Ad.transpose() +
                         out.information.inverse())
                            .inverse();
  graph_.remove_node(submap);
  graph_.add_edge(passing);
  ++counts_.passed;
}

LoopClosure LoopCloser::lifted_loop(const PlanarEdge& edge, double score) const {
  LoopClosure loop;
  loop.from = submaps_[static_cast<std::size_t>(edge.from)].stamp;
  loop.to = submaps_[static_cast<std::size_t>(edge.to)].stamp;
  loop.T_from_to = lifted(edge.T_from_to);
  // Planar by assumption: the floor may rise a little between two visits.
  loop.covariance.diagonal() << 0, 0, 0.05 * 0.05, 0.02 * 0.02, 0.02 * 0.02, 0;
  set_planar_block(edge.information.inverse(), loop.covariance);
  loop.score = score;
  return loop;
}

bool LoopCloser::starts_submap(Timestamp stamp) const {
  const auto at = std::lower_bound(submaps_.begin(), submaps_.end(), stamp,
                                   [](const Submap& s, Timestamp t) { return s.stamp < t; });
  return at != submaps_.end() && at->stamp == stamp;
}

std::size_t LoopCloser::bytes() const { return lamina::bytes(newest_) + store_.bytes(); }

std::vector<LoopClosure> LoopCloser::finish() {
  if (submaps_.empty()) return {};
  return complete_submap();
}

Trajectory LoopCloser::corrected() const {
  Trajectory trajectory;
  for (const ScanPose& s : scans_) {
    const auto k = static_cast<std::size_t>(s.submap);
    PlanarPose T = graph_.pose(s.submap) * s.T_anchor_body;
    if (k + 1 < submaps_.size()) {
      // What the graph changed between two anchors is spread over the way between them.
      const Submap& submap = submaps_[k];
      const PlanarPose end = graph_.pose(s.submap).inverse() * graph_.pose(s.submap + 1);
      const double part = s.progress / std::max(1e-9, submap.travelled + submap.turned);
      const Eigen::Vector3d change = difference(submap.T_anchor_end, end);
      const PlanarPose rest = submap.T_anchor_end.inverse() * s.T_anchor_body;
      // The correction at the end, seen from here, in part.
      const PlanarPose moved = submap.T_anchor_end.boxplus(part * change) * rest;
      T = graph_.pose(s.submap) * moved;
    }
    trajectory.add(s.stamp, lifted(T));
  }
  return trajectory;
}

}  // namespace lamina
