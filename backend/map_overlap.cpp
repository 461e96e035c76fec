// Proposals from pairs of walls, verified by all planes and the area they share.
#include <lamina/backend/map_overlap.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <lamina/models/linalg.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kWallTilt = 25 * kDegree;
constexpr std::size_t kMaxTurns = 16, kMaxHeights = 6, kMaxShifts = 40, kMaxSolved = 60;

// A plane with points of what was seen of it.
struct Sheet {
  PlaneId id = PlaneId::kNone;
  const PlaneLandmark* landmark = nullptr;
  Plane plane;  // map
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> points;  // of its cells, thinned, map
  double point_m2 = 0;                  // area a point stands for
  double area = 0;
  SE3 T_outline_map;

  bool wall() const { return std::abs(plane.normal().z()) < std::sin(kWallTilt); }
  bool level() const { return std::abs(plane.normal().z()) > std::cos(kWallTilt); }
  double heading() const { return std::atan2(plane.normal().y(), plane.normal().x()); }
  // Seen within 0.15 m of where this point falls.
  bool covers(const Eigen::Vector3d& x) const {
    const Eigen::Vector2d p = (T_outline_map * x).head<2>();
    if (landmark->outline.contains(p)) return true;
    for (const double d : {-0.15, 0.15}) {
      if (landmark->outline.contains(p + Eigen::Vector2d(d, 0))) return true;
      if (landmark->outline.contains(p + Eigen::Vector2d(0, d))) return true;
    }
    return false;
  }
};

// Walls that a scanner saw are lines: they count as half a metre high.
double size_of(const OutlineGrid& outline) {
  constexpr double kHeight = 0.5;
  Eigen::Array2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const auto& [i, j] : outline.cells()) {
    low = low.min(Eigen::Array2d(i, j));
    high = high.max(Eigen::Array2d(i + 1, j + 1));
  }
  if (outline.empty()) return 0;
  return std::max(outline.area(), kHeight * outline.cell_size() * (high - low).matrix().norm());
}

std::vector<Sheet> sheets_of(const MapState& map, const OverlapOptions& options) {
  std::vector<Sheet> sheets;
  for (const PlaneLandmark& plane : map.graph.planes) {
    if (!plane.active || size_of(plane.outline) < options.min_area_m2) continue;
    Sheet s;
    s.id = plane.id;
    s.landmark = &plane;
    s.plane = plane.plane_map();
    s.middle = s.plane.project(outline_centroid_map(plane));
    s.area = size_of(plane.outline);
    s.T_outline_map = plane.T_map_outline.inverse();
    const auto cells = plane.outline.cells();
    const std::size_t every = std::max<std::size_t>(1, cells.size() / 150);
    const double side = plane.outline.cell_size();
    for (std::size_t i = 0; i < cells.size(); i += every) {
      const Eigen::Vector2d c = side * Eigen::Vector2d(cells[i].first + 0.5, cells[i].second + 0.5);
      s.points.push_back(plane.T_map_outline * Eigen::Vector3d(c.x(), c.y(), 0));
    }
    s.point_m2 = s.area / static_cast<double>(s.points.size());
    sheets.push_back(std::move(s));
  }
  std::stable_sort(sheets.begin(), sheets.end(),
                   [](const Sheet& x, const Sheet& y) { return x.area > y.area; });
  if (sheets.size() > static_cast<std::size_t>(options.max_planes)) {
    sheets.resize(static_cast<std::size_t>(options.max_planes));
  }
  return sheets;
}

struct Match {
  std::size_t a = 0, b = 0;
  double shared = 0;                                 // m^2
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // of what is shared, map b
};

struct Place {
  SE3 T_a_b;
  std::vector<Match> matches;
  double shared = 0;
};

// A number voted for by pairs of planes, with the area behind it.
struct Vote {
  double value, weight;
};

// The best-supported values, a window of +- `width` each, strongest first. `period` 0: a line.
std::vector<double> peaks(std::vector<Vote> votes, double width, double period, std::size_t most) {
  std::vector<double> found;
  const auto apart = [&](double x, double y) {
    return period > 0 ? std::abs(std::remainder(x - y, period)) : std::abs(x - y);
  };
  while (found.size() < most && !votes.empty()) {
    double best = -1, at = 0;
    for (const Vote& v : votes) {
      double weight = 0, sum = 0;
      for (const Vote& w : votes) {
        if (apart(w.value, v.value) > width) continue;
        const double off =
            period > 0 ? std::remainder(w.value - v.value, period) : w.value - v.value;
        weight += w.weight;
        sum += w.weight * off;
      }
      if (weight > best) {
        best = weight;
        at = v.value + sum / weight;
      }
    }
    found.push_back(at);
    const std::size_t before = votes.size();
    std::erase_if(votes, [&](const Vote& v) { return apart(v.value, at) <= width; });
    if (votes.size() == before) break;
  }
  return found;
}

class Search {
 public:
  Search(const MapState& a, const MapState& b, const OverlapOptions& options)
      : options_(options), a_(sheets_of(a, options)), b_(sheets_of(b, options)) {}

  OverlapResult run();

 private:
  std::vector<double> turns() const;
  std::vector<double> heights() const;
  std::vector<Eigen::Vector2d> shifts(double turn) const;
  Place agreeing(const SE3& T_a_b, double angle, double distance) const;
  std::optional<SE3> solve(const Place& place) const;
  std::optional<Place> settle(const SE3& start) const;
  bool determined(const Place& place) const;
  bool same_frame(const SE3& T) const {
    return T.translation().norm() < options_.same_frame_m &&
           T.so3().log().norm() < options_.same_frame_deg * kDegree;
  }

  OverlapOptions options_;
  std::vector<Sheet> a_, b_;
};

std::vector<double> Search::turns() const {
  std::vector<Vote> votes;
  for (const Sheet& a : a_) {
    for (const Sheet& b : b_) {
      if (!a.wall() || !b.wall()) continue;
      votes.push_back({a.heading() - b.heading(), std::sqrt(std::min(a.area, b.area))});
    }
  }
  std::vector<double> result{0.0};  // both may have started at one mark
  for (const double turn : peaks(std::move(votes), 3 * kDegree, 2 * M_PI, kMaxTurns)) {
    result.push_back(turn);
  }
  return result;
}

std::vector<double> Search::heights() const {
  std::vector<Vote> votes{{0.0, 1e-3}};
  for (const Sheet& a : a_) {
    for (const Sheet& b : b_) {
      if (!a.level() || !b.level() || a.plane.normal().z() * b.plane.normal().z() < 0) continue;
      votes.push_back({a.middle.z() - b.middle.z(), std::min(a.area, b.area)});
    }
  }
  return peaks(std::move(votes), 0.1, 0, kMaxHeights);
}

// Two walls of each map that cross fix x and y. The largest areas speak first.
std::vector<Eigen::Vector2d> Search::shifts(double turn) const {
  const SO3 R = SO3::rot_z(turn);
  struct Line {
    Eigen::Vector2d normal;
    double offset, weight;  // normal . t = offset
  };
  std::vector<Line> lines;
  for (const Sheet& a : a_) {
    for (const Sheet& b : b_) {
      if (!a.wall() || !b.wall()) continue;
      const Eigen::Vector3d n = R * b.plane.normal();
      if (n.dot(a.plane.normal()) < std::cos(options_.seek_angle_deg * kDegree)) continue;
      const Eigen::Vector2d flat = a.plane.normal().head<2>().normalized();
      const Eigen::Vector2d from = (R * b.middle).head<2>(), to = a.middle.head<2>();
      lines.push_back({flat, flat.dot(to - from), std::sqrt(std::min(a.area, b.area))});
    }
  }
  std::stable_sort(lines.begin(), lines.end(),
                   [](const Line& x, const Line& y) { return x.weight > y.weight; });
  if (lines.size() > 160) lines.resize(160);
  constexpr double kCell = 0.4;
  std::map<std::pair<int, int>, std::pair<double, Eigen::Vector2d>> cells;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t j = i + 1; j < lines.size(); ++j) {
      Eigen::Matrix2d N;
      N << lines[i].normal.transpose(), lines[j].normal.transpose();
      const double det = N.determinant();
      if (std::abs(det) < 0.5) continue;
      const Eigen::Vector2d d(lines[i].offset, lines[j].offset);
      const Eigen::Vector2d t = N.inverse() * d;
      const double weight = lines[i].weight * lines[j].weight;
      auto& [sum, mean] = cells[{static_cast<int>(std::floor(t.x() / kCell)),
                                 static_cast<int>(std::floor(t.y() / kCell))}];
      if (sum == 0) mean.setZero();
      sum += weight;
      mean += (t - mean) * (weight / sum);
    }
  }
  std::vector<std::pair<double, Eigen::Vector2d>> ranked;
  for (const auto& [cell, value] : cells) ranked.push_back(value);
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& x, const auto& y) { return x.first > y.first; });
  std::vector<Eigen::Vector2d> result{Eigen::Vector2d::Zero()};
  for (const auto& [weight, t] : ranked) {
    if (result.size() > kMaxShifts) break;
    result.push_back(t);
  }
  return result;
}

// Each plane of b with the plane of a it shares most with.
Place Search::agreeing(const SE3& T_a_b, double angle, double distance) const {
  Place place{T_a_b, {}, 0};
  for (std::size_t j = 0; j < b_.size(); ++j) {
    const Sheet& b = b_[j];
    const Eigen::Vector3d n = T_a_b.so3() * b.plane.normal();
    Match best;
    for (std::size_t i = 0; i < a_.size(); ++i) {
      const Sheet& a = a_[i];
      if (n.dot(a.plane.normal()) < std::cos(angle)) continue;
      Match match{i, j, 0, Eigen::Vector3d::Zero()};
      int count = 0;
      for (const Eigen::Vector3d& p : b.points) {
        const Eigen::Vector3d x = T_a_b * p;
        if (std::abs(a.plane.signed_distance(x)) > 2 * distance || !a.covers(x)) continue;
        match.middle += p;
        ++count;
      }
      if (count == 0) continue;
      match.middle /= count;
      match.shared = count * b.point_m2;
      if (std::abs(a.plane.signed_distance(T_a_b * match.middle)) > distance) continue;
      if (match.shared > best.shared) best = match;
    }
    // A plane and another of which it is a corner are not one plane.
    if (best.shared < 0.2 * std::min(b.area, a_[best.a].area) || best.shared <= 0) continue;
    place.matches.push_back(best);
    place.shared += best.shared;
  }
  return place;
}

// Least squares over the pairs: normals to a degree, distances to 3 cm, weighed by what they share.
std::optional<SE3> Search::solve(const Place& place) const {
  SE3 T = place.T_a_b;
  for (int round = 0; round < 4; ++round) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    for (const Match& m : place.matches) {
      const Sheet &a = a_[m.a], &b = b_[m.b];
      const double weight = std::min(10.0, m.shared);
      const Eigen::Vector3d n = T.so3() * b.plane.normal(), x = T * m.middle;
      const Matrix32d B = a.plane.tangent_basis();
      Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
      J.topRightCorner<2, 3>() = -B.transpose() * SO3::hat(n);
      J.bottomLeftCorner<1, 3>() = a.plane.normal().transpose();
      J.bottomRightCorner<1, 3>() = (x - T.translation()).cross(a.plane.normal()).transpose();
      Eigen::Vector3d r;
      r << B.transpose() * n, a.plane.signed_distance(x);
      const Eigen::Vector3d s(1 / kDegree, 1 / kDegree, 1 / 0.03);
      J = s.asDiagonal() * J;
      r = s.asDiagonal() * r;
      H += weight * J.transpose() * J;
      g += weight * J.transpose() * r;
    }
    H.diagonal().array() += 1e-6;
    const Vector6d d = H.llt().solve(-g);
    if (!d.allFinite() || d.tail<3>().norm() > 1) return std::nullopt;
    T = SE3(SO3::exp(d.tail<3>()) * T.so3(), T.translation() + d.head<3>());
  }
  return T;
}

std::optional<Place> Search::settle(const SE3& start) const {
  Place place = agreeing(start, options_.seek_angle_deg * kDegree, options_.seek_distance_m);
  for (int round = 0; round < 3; ++round) {
    if (place.matches.size() < 3) return std::nullopt;
    const auto T = solve(place);
    if (!T) return std::nullopt;
    const bool last = round > 0;
    place = agreeing(*T, (last ? options_.max_angle_deg : options_.seek_angle_deg) * kDegree,
                     last ? options_.max_distance_m : options_.seek_distance_m);
  }
  return place;
}

// Normals of what agrees span all directions: x, y and z are fixed, and with them the rotation.
bool Search::determined(const Place& place) const {
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  for (const Match& m : place.matches) {
    const Eigen::Vector3d n = a_[m.a].plane.normal();
    N += std::min(4.0, m.shared) * n * n.transpose();
  }
  return symmetric_eigen(N).values(0) > 0.5;  // m^2
}

OverlapResult Search::run() {
  OverlapResult result;
  if (a_.size() < 3 || b_.size() < 3) {
    result.reason = "one of them has fewer than three planes of any size";
    return result;
  }
  std::vector<Place> proposals;
  for (const double turn : turns()) {
    for (const Eigen::Vector2d& shift : shifts(turn)) {
      for (const double height : heights()) {
        const SE3 T(SO3::rot_z(turn), {shift.x(), shift.y(), height});
        Place place = agreeing(T, options_.seek_angle_deg * kDegree, options_.seek_distance_m);
        if (place.matches.size() >= 3) proposals.push_back(std::move(place));
      }
    }
  }
  std::stable_sort(proposals.begin(), proposals.end(),
                   [](const Place& x, const Place& y) { return x.shared > y.shared; });
  if (proposals.size() > kMaxSolved) proposals.resize(kMaxSolved);
  std::vector<Place> places;
  for (const Place& proposal : proposals) {
    if (auto place = settle(proposal.T_a_b)) places.push_back(std::move(*place));
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& x, const Place& y) { return x.shared > y.shared; });
  if (places.empty()) {
    result.reason = "no walls of the one fit those of the other";
    return result;
  }
  const auto other = [](const SE3& x, const SE3& y) {
    const SE3 off = x.inverse() * y;
    return off.translation().norm() > 0.5 || off.so3().log().norm() > 5 * kDegree;
  };
  const auto usable = [&](const Place& p) {
    return p.matches.size() >= static_cast<std::size_t>(options_.min_planes) &&
           p.shared >= options_.min_shared_m2 && determined(p);
  };
  const double enough = options_.max_rival_share * places.front().shared;
  const Place* best = &places.front();
  for (const Place& place : places) {
    if (place.shared >= enough && usable(place) && same_frame(place.T_a_b)) {
      best = &place;
      break;
    }
  }
  for (const Place& rival : places) {
    if (!other(best->T_a_b, rival.T_a_b)) continue;
    result.rival_share = std::max(result.rival_share, rival.shared / best->shared);
  }
  result.shared_m2 = best->shared;
  if (!usable(*best)) {
    result.reason = "they share too little";
  } else if (result.rival_share > options_.max_rival_share && !same_frame(best->T_a_b)) {
    result.reason = "several places fit nearly alike";
  } else {
    MapOverlap overlap{best->T_a_b, {}};
    for (const Match& m : best->matches) overlap.planes.emplace_back(b_[m.b].id, a_[m.a].id);
    result.overlap = std::move(overlap);
  }
  return result;
}

}  // namespace

OverlapResult find_overlap(const MapState& a, const MapState& b, const OverlapOptions& options) {
  return Search(a, b, options).run();
}

}  // namespace lamina
