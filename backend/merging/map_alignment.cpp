// A place in plan believed or not, then lifted to three dimensions and given its pairs of planes.
#include <lamina/backend/merging/map_alignment.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include <lamina/backend/merging/place_search.hpp>
#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kWallTilt = 25 * kDegree;
constexpr double kMaxOff = 0.2;  // m: further apart, planes are not taken for one here

// A plane with points of what was seen of it.
struct Sheet {
  PlaneId id = PlaneId::kNone;
  const PlaneLandmark* landmark = nullptr;
  Plane plane;           // map
  bool partial = false;  // lines of scans: its lean is a prior's
  double sigma_m = 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> points;  // of its cells, thinned, map
  double point_m2 = 0;                  // area a point stands for
  SE3 T_outline_map;
  std::set<std::int64_t> bins;  // walls: where it was seen along, at any height

  bool wall() const { return std::abs(plane.normal().z()) < std::sin(kWallTilt); }
  bool level() const { return std::abs(plane.normal().z()) > std::cos(kWallTilt); }
  std::int64_t bin(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d& n = plane.normal();
    return to_far_cell((n.x() * x.y() - n.y() * x.x()) / 0.15);
  }
  // Seen within 0.15 m of where this point falls; walls at any height.
  bool covers(const Eigen::Vector3d& x) const {
    if (wall()) return bins.count(bin(x)) > 0;
    const Eigen::Vector2d p = (T_outline_map * x).head<2>();
    if (landmark->outline.contains(p)) return true;
    for (const double d : {-0.15, 0.15}) {
      if (landmark->outline.contains(p + Eigen::Vector2d(d, 0))) return true;
      if (landmark->outline.contains(p + Eigen::Vector2d(0, d))) return true;
    }
    return false;
  }
};

std::vector<Sheet> sheets_of(const MapState& map) {
  std::vector<Sheet> sheets;
  for (const PlaneLandmark& plane : map.graph.planes) {
    if (!plane.active || plane.outline.empty()) continue;
    Sheet s;
    s.id = plane.id;
    s.landmark = &plane;
    s.plane = plane.plane_map();
    s.partial = map.partial.count(plane.id) > 0;
    s.sigma_m = plane.covariance ? std::sqrt(std::max(0.0, (*plane.covariance)(2, 2))) : 0.1;
    s.middle = s.plane.project(outline_centroid_map(plane));
    s.T_outline_map = plane.T_map_outline.inverse();
    const auto cells = plane.outline.cells();
    const std::size_t every = std::max<std::size_t>(1, cells.size() / 150);
    const double side = plane.outline.cell_size();
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Eigen::Vector2d c = side * Eigen::Vector2d(cells[i].first + 0.5, cells[i].second + 0.5);
      const Eigen::Vector3d x = plane.T_map_outline * Eigen::Vector3d(c.x(), c.y(), 0);
      s.bins.insert(s.bin(x));
      if (i % every == 0) s.points.push_back(x);
    }
    s.point_m2 = plane.outline.area() / static_cast<double>(s.points.size());
    sheets.push_back(std::move(s));
  }
  return sheets;
}

struct Match {
  std::size_t a = 0, b = 0;
  double shared = 0;                                 // m^2
  double off = 0;                                    // m, at the middle
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // of what is shared, map b
};

class Lift {
 public:
  Lift(const MapState& a, const MapState& b, const OverlapOptions& options)
      : options_(options), a_(sheets_of(a)), b_(sheets_of(b)) {}

  // The whole motion, and which planes are one.
  MapOverlap lift(const PlanPose& plan) const;

 private:
  double height(const SE3& T_a_b) const;
  std::optional<Match> match(const Sheet& a, const Sheet& b, const SE3& T_a_b, double gate) const;
  std::vector<Match> matches(const SE3& T_a_b, bool sure) const;
  Vector6d held(const std::vector<Match>& matches) const;
  SE3 solved(const SE3& T_a_b, const std::vector<Match>& matches) const;

  OverlapOptions options_;
  std::vector<Sheet> a_, b_;
};

// The difference of height with the largest level area in agreement; none: as it is.
double Lift::height(const SE3& T_a_b) const {
  struct Vote {
    double z, weight;
  };
  std::vector<Vote> votes;
  for (const Sheet& b : b_) {
    if (!b.level()) continue;
    for (const Sheet& a : a_) {
      if (!a.level() || (T_a_b.so3() * b.plane.normal()).dot(a.plane.normal()) < 0.9) continue;
      double shared = 0;
      for (const Eigen::Vector3d& p : b.points) shared += a.covers(T_a_b * p) ? b.point_m2 : 0;
      if (shared > 0) votes.push_back({a.middle.z() - (T_a_b * b.middle).z(), shared});
    }
  }
  double best = 0, at = 0;
  for (const Vote& v : votes) {
    double weight = 0, sum = 0;
    for (const Vote& w : votes) {
      if (std::abs(w.z - v.z) > 0.1) continue;
      weight += w.weight;
      sum += w.weight * w.z;
    }
    if (weight <= best) continue;
    best = weight;
    at = sum / weight;
  }
  return at;
}

std::optional<Match> Lift::match(const Sheet& a, const Sheet& b, const SE3& T_a_b,
                                 double gate) const {
  Eigen::Vector3d na = a.plane.normal(), nb = T_a_b.so3() * b.plane.normal();
  if (a.wall() && b.wall() && (a.partial || b.partial)) {
    na.z() = nb.z() = 0;
    na.normalize();
    nb.normalize();
  }
  if (nb.dot(na) < std::cos(options_.max_angle_deg * kDegree)) return std::nullopt;
  Match m;
  std::size_t count = 0;
  for (const Eigen::Vector3d& p : b.points) {
    const Eigen::Vector3d x = T_a_b * p;
    if (std::abs(a.plane.signed_distance(x)) > 2 * gate || !a.covers(x)) continue;
    m.middle += p;
    ++count;
  }
  // A plane and another of which it is a corner are not one plane.
  if (10 * count < b.points.size() || count == 0) return std::nullopt;
  m.middle /= static_cast<double>(count);
  m.shared = static_cast<double>(count) * b.point_m2;
  m.off = a.plane.signed_distance(T_a_b * m.middle);
  if (std::abs(m.off) > gate) return std::nullopt;
  return m;
}

// Each plane of b with the nearest of a. Sure: within what both are known to, and no other of a is
// nearly as near; the rest is for the refined graph to decide (plane_doubles.hpp).
std::vector<Match> Lift::matches(const SE3& T_a_b, bool sure) const {
  std::vector<Match> result;
  for (std::size_t j = 0; j < b_.size(); ++j) {
    std::optional<Match> best;
    double next = 1e9;
    for (std::size_t i = 0; i < a_.size(); ++i) {
      auto found = match(a_[i], b_[j], T_a_b, options_.max_distance_m);
      if (!found) continue;
      found->a = i;
      found->b = j;
      if (!best || std::abs(found->off) < std::abs(best->off)) std::swap(best, found);
      if (found) {
        const bool coplanar = std::abs(found->off - best->off) < 0.04;
        if (!coplanar) next = std::min(next, std::abs(found->off));
      }
    }
    if (!best) continue;
    const double sigma = Eigen::Vector3d(a_[best->a].sigma_m, b_[j].sigma_m, 0.03).norm();
    const double off = std::abs(best->off), gate = std::clamp(2.5 * sigma, 0.08, kMaxOff);
    if (!sure || (off < gate && 2 * off < next)) result.push_back(*best);
  }
  return result;
}

// What no plane tells stays: lines of scans say nothing of height and tilt.
Vector6d Lift::held(const std::vector<Match>& matches) const {
  constexpr double kHeld = 1e12;
  Vector6d hold = (Vector6d() << 1, 1, kHeld, kHeld, kHeld, 1).finished();
  for (const Match& m : matches) {
    if (a_[m.a].partial || b_[m.b].partial) continue;
    hold.segment<2>(3).setConstant(1e3);
    if (a_[m.a].level()) hold(2) = 1;
  }
  return hold;
}

// Least squares over the pairs: normals to a degree, distances to 3 cm, weighed by what they share.
SE3 Lift::solved(const SE3& T_a_b, const std::vector<Match>& matches) const {
  SE3 T = T_a_b;
  for (int round = 0; round < 3; ++round) {
    Matrix6d H = held(matches).asDiagonal();
    Vector6d g = Vector6d::Zero();
    for (const Match& m : matches) {
      const Sheet &a = a_[m.a], &b = b_[m.b];
      const double weight = std::clamp(m.shared, 0.1, 10.0);
      const Eigen::Vector3d n = T.so3() * b.plane.normal(), x = T * m.middle;
      Matrix32d B = a.plane.tangent_basis();
      if (a.partial || b.partial) {  // headings alone
        B.col(0) = a.plane.normal().cross(Eigen::Vector3d::UnitZ());
        B.col(1).setZero();
      }
      Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
      J.topRightCorner<2, 3>() = -B.transpose() * SO3::hat(n);
      J.bottomLeftCorner<1, 3>() = a.plane.normal().transpose();
      J.bottomRightCorner<1, 3>() = (x - T.translation()).cross(a.plane.normal()).transpose();
      Eigen::Vector3d r;
      r << B.transpose() * n, a.plane.signed_distance(x);
      const Eigen::Vector3d s(1 / kDegree, 1 / kDegree, 1 / 0.03);
      J = s.asDiagonal() * J;
      r = s.asDiagonal() * r;
      const double robust = 1 / (1 + r.squaredNorm() / 9);
      H += weight * robust * J.transpose() * J;
      g += weight * robust * J.transpose() * r;
    }
    const Vector6d d = H.llt().solve(-g);
    if (!d.allFinite() || d.tail<3>().norm() > 0.2) return T_a_b;
    T = SE3(SO3::exp(d.tail<3>()) * T.so3(), T.translation() + d.head<3>());
  }
  return T;
}

MapOverlap Lift::lift(const PlanPose& plan) const {
  SE3 T(SO3::rot_z(plan.yaw), {plan.t.x(), plan.t.y(), 0});
  T = SE3(T.so3(), T.translation() + Eigen::Vector3d(0, 0, height(T)));
  for (int round = 0; round < 3; ++round) T = solved(T, matches(T, false));
  MapOverlap overlap{T, {}, false};
  for (const Match& m : matches(T, true)) {
    const Sheet &a = a_[m.a], &b = b_[m.b];
    overlap.planes.emplace_back(b.id, a.id);
    overlap.level = overlap.level || (a.level() && !a.partial && !b.partial);
  }
  return overlap;
}

double most_evidence_elsewhere(const std::vector<PlanPlace>& places, const PlanPlace& best) {
  double most = 0;
  for (const PlanPlace& p : places) {
    if (&p != &best) most = std::max(most, p.evidence.nats);
  }
  return most;
}

// What a place gains by leaving the frames where they are up to the drift of two runs: a start at
// one mark is as likely, before any wall is looked at, as all other places together.
double gain_of_one_mark(const PlanPose& T, double log_places) {
  const double r = T.t.norm(), turn = std::abs(std::remainder(T.yaw, 2 * M_PI));
  if (r > 2 || turn > 10 * kDegree) return 0;
  const double as_near =
      std::log(1 + M_PI * r * r / (0.3 * 0.3)) + std::log(1 + 2 * turn / (3 * kDegree));
  return std::max(0.0, log_places - as_near);
}

std::string number(double x, int decimals) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.*f", decimals, x);
  return text;
}

std::string of_needed(double x, double needed) {
  return number(x, 1) + " of " + number(needed, 1) + " needed";
}

std::string tally(const PlaceEvidence& e) {
  return ": " + number(e.same, 0) + " lines of walls alike, " + number(e.other, 0) + " not; " +
         number(e.same_m, 1) + " m of wall alike, " + number(e.through_m, 1) +
         " m that rays went through";
}

bool elsewhere(const PlanPose& x, const PlanPose& y, const PlanWalls& b) {
  const Eigen::Vector2d middle = (b.low() + b.high()) / 2;
  return (x * middle - y * middle).norm() > 0.5 ||
         std::abs(std::remainder(x.yaw - y.yaw, 2 * M_PI)) > 5 * kDegree;
}

// Motions that lay a map upon itself and would be believed: rooms that repeat.
std::vector<PlanPose> repetitions(const PlanWalls& map, double log_odds) {
  std::vector<PlanPose> result;
  const PlaceSearchResult search = search_places(map, map);
  for (const PlanPlace& p : search.places) {
    const bool accepted = p.evidence.nats > search.log_places + log_odds;
    if (accepted && elsewhere(p.T_a_b, PlanPose(), map)) result.push_back(p.T_a_b);
  }
  return result;
}

// The least that rays through walls say against a place one repetition beside T, over what they say
// against T itself; that place may have been seen by one map alone, so little may be for it.
double least_against_repeated(const PlanWalls& a, const PlanWalls& b, const PlanPose& T,
                              double through_m, double log_odds) {
  std::vector<PlanPose> beside;
  for (const PlanPose& s : repetitions(a, log_odds)) beside.push_back(s * T);
  for (const PlanPose& s : repetitions(b, log_odds)) beside.push_back(T * s);
  double least = 1e9;
  for (const PlanPose& place : beside) {
    const double through = weigh_place(a, b, place).through_m - through_m;
    least = std::min(least, kThroughPerMetre * through);
  }
  return least;
}

// Why the best place is not to be believed; empty where it is, as far as itself and the other
// places say.
std::string objection(const OverlapResult& result, const PlanPlace& best,
                      const OverlapOptions& options) {
  const PlaceEvidence& e = best.evidence;
  if (result.evidence < result.needed) {
    return "evidence " + of_needed(e.nats, result.needed) + tally(e);
  }
  if (!best.determined) return "the walls they share leave a direction open" + tally(e);
  if (result.lead < options.log_odds) {
    return "several places fit alike: lead " + of_needed(result.lead, options.log_odds) + tally(e);
  }
  if (e.through_m > options.max_free_share * (e.same_m + e.through_m)) {
    return "they contradict each other" + tally(e);
  }
  return {};
}

// As objection(): where rooms repeat and rays do not rule out the next one.
std::string repetition(const PlanWalls& a, const PlanWalls& b, const PlanPlace& best,
                       const OverlapOptions& options) {
  const PlaceEvidence& e = best.evidence;
  const double against = least_against_repeated(a, b, best.T_a_b, e.through_m, options.log_odds);
  if (!(against < options.log_odds)) return {};
  return "rooms repeat, and against the next one rays say " +
         of_needed(std::max(0.0, against), options.log_odds) + tally(e);
}

}  // namespace

OverlapResult find_overlap(const MapState& a, const MapState& b, const FreeSpace& free_a,
                           const FreeSpace& free_b, const OverlapOptions& options) {
  OverlapResult result;
  const PlanWalls walls_a(a, free_a), walls_b(b, free_b);
  const PlaceSearchResult search = search_places(walls_a, walls_b);
  if (search.places.empty()) {
    result.reason = "no walls of the one fit those of the other";
    return result;
  }
  const auto gain = [&](const PlanPlace& p) {
    return gain_of_one_mark(p.T_a_b, search.log_places);
  };
  const auto odds = [&](const PlanPlace& p) { return p.evidence.nats + gain(p); };
  const auto best =
      std::max_element(search.places.begin(), search.places.end(),
                       [&](const PlanPlace& x, const PlanPlace& y) { return odds(x) < odds(y); });
  const PlaceEvidence& e = best->evidence;
  const double next = most_evidence_elsewhere(search.places, *best);
  // All places but one are wrong. Where one of those would be believed by itself, rooms repeat, and
  // facts that come together count as one: as many as make it just not believed.
  const double repeats = std::max(1.0, next / (search.log_places + options.log_odds));
  result.evidence = e.nats;
  result.needed = options.log_odds + search.log_places - gain(*best);
  result.lead = 1e9;
  for (const PlanPlace& p : search.places) {
    if (&p == &*best) continue;
    const double lead = (e.nats - p.evidence.nats) / repeats + gain(*best) - gain(p);
    result.lead = std::min(result.lead, lead);
  }
  result.wall_m = e.same_m;
  result.through_m = e.through_m;
  result.kept_frame = (e.nats - next) / repeats < options.log_odds;
  // Frames that are one need no room to be told from the next.
  const bool one_mark = gain(*best) > search.log_places / 2;
  result.reason = objection(result, *best, options);
  if (result.reason.empty() && !one_mark) {
    result.reason = repetition(walls_a, walls_b, *best, options);
  }
  if (result.reason.empty()) result.overlap = Lift(a, b, options).lift(best->T_a_b);
  return result;
}

}  // namespace lamina
