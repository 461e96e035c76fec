// Walls correlated over all shifts; the best places solved and weighed.
#include <lamina/backend/merging/place_search.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kSeekAngle = 8 * kDegree;
constexpr std::size_t kMaxTurns = 24, kMaxPeaks = 12, kMaxWeighed = 12;
constexpr double kTurnWidth = 2 * kDegree;
constexpr double kSeen = 0.75, kLeastRun = 0.5;  // of PlaceEvidence

double wrapped(double angle) { return std::remainder(angle, 2 * M_PI); }

// How far apart two maps may show one wall: what both know of it and a centimetre or two.
double gate_for(double sigma) { return std::clamp(2.5 * std::hypot(sigma, 0.03), 0.1, 0.3); }

class Search {
 public:
  Search(const PlanWalls& a, const PlanWalls& b) : a_(a), b_(b) {}
  PlaceSearchResult run();

 private:
  struct Start {
    PlanPose T_a_b;
    double score = 0;
  };
  std::vector<double> turns() const;
  bool draw_facing(const Eigen::Vector2d& normal, Eigen::ArrayXXf& grid) const;
  void add_shifts(const PlanWall& wall, const Eigen::Matrix2d& R, const Eigen::Vector2d& high,
                  const Eigen::ArrayXXf& grid, Eigen::ArrayXXf& sum) const;
  void take_peaks(Eigen::ArrayXXf& sum, const Eigen::Vector2d& origin, double yaw,
                  std::vector<Start>& starts) const;
  void correlate(double yaw, std::vector<Start>& starts);
  bool solve(PlanPlace& place) const;
  double step(PlanPlace& place, double gate) const;

  const PlanWalls &a_, &b_;
  double cell_ = 0.2;
  std::size_t tried_ = 0;  // cells of shifts, over all turns
};

// Headings of pairs of walls; a window of 2 degrees each, strongest first.
std::vector<double> Search::turns() const {
  constexpr int kBins = 720;
  std::vector<double> votes(kBins, 0.0);
  for (const PlanWall& a : a_.walls()) {
    for (const PlanWall& b : b_.walls()) {
      const double turn = std::atan2(b.normal.x() * a.normal.y() - b.normal.y() * a.normal.x(),
                                     b.normal.dot(a.normal));
      const int bin = static_cast<int>(std::floor((turn / (2 * M_PI) + 1) * kBins)) % kBins;
      votes[static_cast<std::size_t>(bin)] +=
          std::sqrt(static_cast<double>(std::min(a.points.size(), b.points.size())));
    }
  }
  std::vector<double> result{0.0};  // both may have started at one mark
  double strongest = 0;
  const int half = static_cast<int>(kTurnWidth / (2 * M_PI) * kBins);
  while (result.size() < kMaxTurns) {
    double best = 0, at = 0;
    for (int i = 0; i < kBins; ++i) {
      double weight = 0, sum = 0;
      for (int d = -half; d <= half; ++d) {
        const double v = votes[static_cast<std::size_t>((i + d + kBins) % kBins)];
        weight += v;
        sum += v * d;
      }
      if (weight <= best) continue;
      best = weight;
      at = i + 0.5 + sum / weight;
    }
    strongest = std::max(strongest, best);
    if (best <= 0 || best < 0.1 * strongest) break;
    result.push_back(wrapped(at / kBins * 2 * M_PI));
    for (int i = 0; i < kBins; ++i) {
      if (std::abs(std::remainder(i + 0.5 - at, kBins)) <= half)
        votes[static_cast<std::size_t>(i)] = 0;
    }
  }
  return result;
}

// Walls that face one way, to 4 degrees, share the grid of what they would find.
std::vector<std::pair<double, std::vector<const PlanWall*>>> by_heading(const PlanWalls& map) {
  std::vector<std::pair<double, std::vector<const PlanWall*>>> headings;
  for (const PlanWall& wall : map.walls()) {
    const double heading = std::atan2(wall.normal.y(), wall.normal.x());
    auto it = std::find_if(headings.begin(), headings.end(), [&](const auto& h) {
      return std::abs(wrapped(h.first - heading)) < 4 * kDegree;
    });
    if (it == headings.end()) it = headings.insert(it, {heading, {}});
    it->second.push_back(&wall);
  }
  return headings;
}

// The cells of a's walls that face along `normal`; false where none does.
bool Search::draw_facing(const Eigen::Vector2d& normal, Eigen::ArrayXXf& grid) const {
  bool any = false;
  for (const PlanWall& wall : a_.walls()) {
    if (wall.normal.dot(normal) < std::cos(kSeekAngle + 4 * kDegree)) continue;
    for (const auto& p : wall.points) {
      for (const double off : {-0.5, 0.0, 0.5}) {
        const Eigen::Vector2d c = (p + off * cell_ * wall.normal - a_.low()) / cell_;
        const auto i = static_cast<Eigen::Index>(std::floor(c.x() + 1));
        const auto j = static_cast<Eigen::Index>(std::floor(c.y() + 1));
        grid(std::clamp<Eigen::Index>(i, 0, grid.rows() - 1),
             std::clamp<Eigen::Index>(j, 0, grid.cols() - 1)) = 1;
        any = true;
      }
    }
  }
  return any;
}

// What of `grid` stands at the points of one of b's walls, for every shift of it; `high` is b's
// upper corner.
void Search::add_shifts(const PlanWall& wall, const Eigen::Matrix2d& R, const Eigen::Vector2d& high,
                        const Eigen::ArrayXXf& grid, Eigen::ArrayXXf& sum) const {
  // Long walls say little more than short ones.
  const auto count = static_cast<double>(wall.points.size());
  const std::size_t every = std::max<std::size_t>(1, std::lround(cell_ / PlanWalls::kStep));
  const auto weight = static_cast<float>(static_cast<double>(every) / std::sqrt(count));
  for (std::size_t k = every / 2; k < wall.points.size(); k += every) {
    const Eigen::Vector2d c = (high - R * wall.points[k]) / cell_;
    sum.block(static_cast<Eigen::Index>(c.x()), static_cast<Eigen::Index>(c.y()), grid.rows(),
              grid.cols()) += weight * grid;
  }
}

// The largest sums, no two of them within 0.6 m. `origin`: shift of the first cell.
void Search::take_peaks(Eigen::ArrayXXf& sum, const Eigen::Vector2d& origin, double yaw,
                        std::vector<Start>& starts) const {
  const Eigen::Index sx = sum.rows(), sy = sum.cols();
  const auto away = static_cast<Eigen::Index>(std::ceil(0.6 / cell_));
  for (std::size_t n = 0; n < kMaxPeaks; ++n) {
    Eigen::Index i = 0, j = 0;
    const float best = sum.maxCoeff(&i, &j);
    if (best <= 0) break;
    const Eigen::Vector2d t = origin + cell_ * Eigen::Vector2d(static_cast<double>(i) - 0.5,
                                                               static_cast<double>(j) - 0.5);
    starts.push_back({{t, yaw}, static_cast<double>(best)});
    const Eigen::Index i0 = std::max<Eigen::Index>(0, i - away),
                       j0 = std::max<Eigen::Index>(0, j - away);
    sum.block(i0, j0, std::min(sx, i + away + 1) - i0, std::min(sy, j + away + 1) - j0).setZero();
  }
}

// Sums, for every shift at once, what stands at each point of b: one pass over a's grid a point.
void Search::correlate(double yaw, std::vector<Start>& starts) {
  const Eigen::Matrix2d R = PlanPose{Eigen::Vector2d::Zero(), yaw}.R();
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const PlanWall& wall : b_.walls()) {
    for (const auto& p : wall.points) {
      low = low.cwiseMin(R * p);
      high = high.cwiseMax(R * p);
    }
  }
  const Eigen::Vector2d size_a = a_.high() - a_.low(), size_b = high - low;
  constexpr double kCoarsest = 1e4;  // m: maps are smaller than a thousand of these
  while (cell_ < kCoarsest && (size_a + size_b).prod() / (cell_ * cell_) > 2e6) cell_ *= 1.25;
  const auto cells = [&](double metres) {
    return to_whole<Eigen::Index>(metres / cell_, 0, 1000000) + 3;
  };
  const Eigen::Index nx = cells(size_a.x()), ny = cells(size_a.y());
  const Eigen::Index sx = nx + cells(size_b.x()), sy = ny + cells(size_b.y());
  Eigen::ArrayXXf sum = Eigen::ArrayXXf::Zero(sx, sy);
  for (const auto& [heading, walls] : by_heading(b_)) {
    Eigen::ArrayXXf grid = Eigen::ArrayXXf::Zero(nx, ny);
    if (!draw_facing(R * Eigen::Vector2d(std::cos(heading), std::sin(heading)), grid)) continue;
    for (const PlanWall* wall : walls) add_shifts(*wall, R, high, grid, sum);
  }
  tried_ += static_cast<std::size_t>(sx * sy);
  take_peaks(sum, a_.low() - high, yaw, starts);
}

// One step of least squares over all points of b that find their wall; returns its length.
double Search::step(PlanPlace& place, double gate) const {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  const Eigen::Matrix2d R = place.T_a_b.R();
  const Eigen::Vector2d pivot = R * (b_.low() + b_.high()) / 2;
  for (const PlanWall& wall : b_.walls()) {
    Eigen::Matrix3d H_wall = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g_wall = Eigen::Vector3d::Zero();
    for (const auto& p : wall.points) {
      const Eigen::Vector2d x = R * p, n = R * wall.normal;
      const auto found = a_.nearest(x + place.T_a_b.t, n, gate, kSeekAngle);
      if (found.wall == nullptr) continue;
      const Eigen::Vector2d& na = found.wall->normal;
      const Eigen::Vector2d arm = x - pivot;
      const Eigen::Vector3d J(na.x(), na.y(), na.y() * arm.x() - na.x() * arm.y());
      const double w = 1 / (1 + std::pow(found.off / 0.1, 2));
      H_wall += w * J * J.transpose();
      g_wall += w * J * found.off;
    }
    // A wall is one fact known to 5 cm, however long; its length tells the heading.
    const double share = 1 / std::sqrt(static_cast<double>(wall.points.size()));
    H += share * H_wall;
    g += share * g_wall;
  }
  const Eigen::Matrix3d held = H + Eigen::Vector3d(1e-3, 1e-3, 1e-2).asDiagonal().toDenseMatrix();
  const Eigen::Vector3d d = held.llt().solve(-g);
  if (!d.allFinite()) return 1e9;
  place.T_a_b.yaw += d.z();
  place.T_a_b.t += d.head<2>() + pivot - PlanPose{{0, 0}, d.z()}.R() * pivot;
  const Eigen::Matrix3d C = held.inverse() * 0.05 * 0.05;
  place.determined =
      C(0, 0) < 0.05 * 0.05 && C(1, 1) < 0.05 * 0.05 && C(2, 2) < std::pow(2 * kDegree, 2);
  return d.norm();
}

bool Search::solve(PlanPlace& place) const {
  const PlanPose start = place.T_a_b;
  for (const double gate : {0.5, 0.4, 0.3, 0.3, 0.2, 0.2}) {
    if (step(place, gate) > 1e6) return false;
  }
  const Eigen::Vector2d middle = (b_.low() + b_.high()) / 2;
  return (place.T_a_b * middle - start * middle).norm() < 3 &&
         std::abs(wrapped(place.T_a_b.yaw - start.yaw)) < 10 * kDegree;
}

// Share of the places beside it at which a line of walls would be taken for one of `in`.
double chance(const PlanWalls& of, const PlanWalls& in, const PlanPose& T, std::size_t line) {
  const Eigen::Matrix2d R = T.R();
  double same = 1, all = 4;
  for (int k = -20; k <= 20; ++k) {
    int s = 0, known = 0;
    for (const PlanWall& wall : of.walls()) {
      if (wall.line != line) continue;
      const Eigen::Vector2d n = R * wall.normal;
      const std::size_t every = 1 + wall.points.size() / 30;
      for (std::size_t i = every / 2; i < wall.points.size(); i += every) {
        const Spot spot =
            in.look(R * wall.points[i] + T.t + 0.2 * k * n, n, gate_for(wall.sigma_m), wall);
        s += spot == Spot::kSame;
        known += spot != Spot::kUnknown;
      }
    }
    if (known == 0) continue;
    all += 1;
    same += 2 * s >= known;
  }
  return same / all;
}

// Half of the evidence: lines of the one map where the other has looked.
void weigh_lines(const PlanWalls& of, const PlanWalls& in, const PlanPose& T, bool thorough,
                 PlaceEvidence& evidence) {
  struct Count {
    int same = 0, not_same = 0;
  };
  std::vector<Count> lines(of.lines());
  const Eigen::Matrix2d R = T.R();
  for (const PlanWall& wall : of.walls()) {
    const Eigen::Vector2d n = R * wall.normal;
    Count& c = lines[wall.line];
    double through = 0;
    const auto end_run = [&] {
      if (through >= kLeastRun) {
        evidence.through_m += through;
        evidence.nats -= kThroughPerMetre * through;
      }
      through = 0;
    };
    for (const auto& p : wall.points) {
      const Spot spot = in.look(R * p + T.t, n, gate_for(wall.sigma_m), wall);
      c.same += spot == Spot::kSame;
      c.not_same += spot == Spot::kOther || spot == Spot::kFree;
      if (spot == Spot::kFree) {
        through += PlanWalls::kStep;
      } else {
        end_run();
      }
    }
    end_run();
  }
  for (std::size_t line = 0; line < lines.size(); ++line) {
    const auto [same, not_same] = lines[line];
    if (same + not_same < 2) continue;
    evidence.same_m += PlanWalls::kStep * same / 2;
    const double p = thorough ? chance(of, in, T, line) : 0.2;
    const bool seen = same >= not_same;
    (seen ? evidence.same : evidence.other) += 0.5;
    evidence.nats += 0.5 * (seen ? std::log(kSeen / p) : std::log((1 - kSeen) / (1 - p)));
  }
}

PlaceEvidence weigh(const PlanWalls& a, const PlanWalls& b, const PlanPose& T_a_b, bool thorough) {
  PlaceEvidence evidence;
  const PlanPose T_b_a{-(T_a_b.R().transpose() * T_a_b.t), -T_a_b.yaw};
  weigh_lines(b, a, T_a_b, thorough, evidence);
  weigh_lines(a, b, T_b_a, thorough, evidence);
  return evidence;
}

PlaceSearchResult Search::run() {
  PlaceSearchResult result;
  if (a_.walls().empty() || b_.walls().empty()) return result;
  std::vector<Start> starts;
  for (const double yaw : turns()) correlate(yaw, starts);
  starts.push_back({PlanPose(), 0});
  result.log_places =
      std::log(static_cast<double>(std::max<std::size_t>(tried_, 1)) * cell_ * cell_ / 0.09);
  std::vector<PlanPlace> places;
  for (const Start& start : starts) {
    PlanPlace place{start.T_a_b, {}, false};
    if (!solve(place)) continue;
    place.evidence = weigh(a_, b_, place.T_a_b, false);
    places.push_back(place);
  }
  const auto likelier = [](const PlanPlace& x, const PlanPlace& y) {
    return x.evidence.nats > y.evidence.nats;
  };
  const Eigen::Vector2d middle = (b_.low() + b_.high()) / 2;
  const auto thin = [&](std::size_t most) {
    std::stable_sort(places.begin(), places.end(), likelier);
    std::vector<PlanPlace> kept;
    for (const PlanPlace& p : places) {
      const bool known = std::any_of(kept.begin(), kept.end(), [&](const PlanPlace& k) {
        return (p.T_a_b * middle - k.T_a_b * middle).norm() < 0.5 &&
               std::abs(wrapped(p.T_a_b.yaw - k.T_a_b.yaw)) < 5 * kDegree;
      });
      if (!known && kept.size() < most) kept.push_back(p);
    }
    places = std::move(kept);
  };
  thin(kMaxWeighed);
  for (PlanPlace& place : places) place.evidence = weigh(a_, b_, place.T_a_b, true);
  thin(kMaxWeighed);
  result.places = std::move(places);
  return result;
}

}  // namespace

PlaceSearchResult search_places(const PlanWalls& a, const PlanWalls& b) {
  return Search(a, b).run();
}

PlaceEvidence weigh_place(const PlanWalls& a, const PlanWalls& b, const PlanPose& T_a_b) {
  return weigh(a, b, T_a_b, true);
}

}  // namespace lamina
