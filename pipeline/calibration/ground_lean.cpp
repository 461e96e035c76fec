// Leans tried one by one, the best fitted to what ends on its line.
#include <lamina/pipeline/calibration/ground_lean.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace lamina {
namespace {

constexpr double kTurning = 0.02, kLeastTurned = 1.5;  // rad: between two that are taken, all
constexpr std::size_t kBeams = 120, kMostReturns = 400000, kTried = 20000;
constexpr double kLeastHeight = 0.05;              // m
constexpr double kLeast = 0.02, kMostOff = 0.1;    // rad, of a lean; of its correction
constexpr double kLeastOff = 0.006;                // rad
constexpr double kStep = 1.04, kTurn = M_PI / 60;  // of the leans that are tried: ratio, rad
constexpr double kFacing = 0.8;                    // cosine: beams that go down most
constexpr double kBefore = 0.8, kBand = 0.07, kSharpBand = 0.035;  // of the range
constexpr int kLeastOn = 150, kLeastAHeading = 10, kLeastHeadings = 3;
constexpr double kStops = 0.9, kSharp = 0.85;  // shares
constexpr double kDenser = 4;                  // returns a metre on the line, to those before it
constexpr int kRounds = 4;

}  // namespace

bool GroundLean::may_tell(const LaserScan& scan) {
  return scan.lidar.T_body_lidar.translation().z() >= kLeastHeight;
}

bool GroundLean::wants_more() const { return !several_ && returns_.size() < kMostReturns; }

void GroundLean::add(const LaserScan& scan, double turned) {
  heading_ += turned;
  since_ += turned;
  if (!T_body_lidar_) T_body_lidar_ = scan.lidar.T_body_lidar;
  several_ = several_ || (T_body_lidar_->inverse() * scan.lidar.T_body_lidar).log().norm() > 1e-9;
  if (!wants_more() || !may_tell(scan) || std::abs(since_) < kTurning) return;
  turned_ += std::abs(since_);
  since_ = 0;
  const double eighths = std::floor(heading_ / (M_PI / 4));
  const auto heading = static_cast<std::uint8_t>(static_cast<std::int64_t>(eighths) & 7);
  const std::size_t every = std::max<std::size_t>(1, scan.size() / kBeams);
  for (std::size_t i = 0; i < scan.size(); i += every) {
    if (!scan.valid(i)) continue;
    const double a = scan.angle(i);
    returns_.push_back({static_cast<float>(std::cos(a)), static_cast<float>(std::sin(a)),
                        scan.ranges[i], heading});
  }
}

// Walls that a room ends with stop all beams, too; but not all in one place.
bool GroundLean::Evidence::stops_beams() const {
  constexpr double kWidths = 2 * kSharpBand / (1 - kBand - kBefore);
  return on > 0 && on >= kStops * (on + beyond) && sharp >= kSharp * on &&
         sharp >= kDenser * kWidths * before;
}

bool GroundLean::Evidence::is_ground() const { return headings >= kLeastHeadings && stops_beams(); }

// Of every `every`-th return between two, by their indices.
GroundLean::Evidence GroundLean::evidence(const Eigen::Vector2d& lean, std::size_t first,
                                          std::size_t end, std::size_t every) const {
  const float height = static_cast<float>(T_body_lidar_->translation().z());
  const Eigen::Vector2f u = lean.cast<float>();
  const float least = static_cast<float>(kFacing * lean.norm());
  constexpr float kNear = static_cast<float>(1 - kBand), kFar = static_cast<float>(1 + kBand);
  Evidence found;
  std::array<int, 8> of_heading{};
  for (std::size_t i = first; i < end; i += every) {
    const Return& r = returns_[i];
    const float slope = -(u.x() * r.cosine + u.y() * r.sine);
    if (slope < least) continue;
    const float ratio = r.range * slope / height;  // 1 on the ground
    if (ratio < static_cast<float>(kBefore)) continue;
    if (ratio < kNear) {
      ++found.before;
    } else if (ratio > kFar) {
      ++found.beyond;
    } else {
      ++found.on;
      found.sharp += std::abs(ratio - 1) < static_cast<float>(kSharpBand) ? 1 : 0;
      ++of_heading[r.heading];
    }
  }
  const int times = static_cast<int>(every);
  found.headings =
      static_cast<int>(std::count_if(of_heading.begin(), of_heading.end(), [times](int count) {
        return count * times >= kLeastAHeading;
      }));
  if (found.on * times < kLeastOn) found.headings = 0;
  return found;
}

// Least squares over -u . (x, y) = h, relative to the range.
std::optional<Eigen::Vector2d> GroundLean::fitted(Eigen::Vector2d lean) const {
  const double height = T_body_lidar_->translation().z();
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for (const Return& r : returns_) {
      const Eigen::Vector2d down(-static_cast<double>(r.cosine), -static_cast<double>(r.sine));
      const double slope = lean.dot(down), range = static_cast<double>(r.range);
      if (slope < kFacing * lean.norm() || std::abs(range * slope / height - 1) > kSharpBand)
        continue;
      H += down * down.transpose();
      b += down * (height / range);
    }
    const Eigen::LDLT<Eigen::Matrix2d> solver(H);
    if (!solver.isPositive() || !(H.determinant() > 1e-9)) return std::nullopt;
    lean = solver.solve(b);
    if (!lean.allFinite() || lean.norm() < kLeast / 2) return std::nullopt;
  }
  return lean;
}

std::optional<MountingCorrection> GroundLean::correction() const {
  if (several_ || turned_ < kLeastTurned || !T_body_lidar_) return std::nullopt;
  const SO3& R = T_body_lidar_->so3();
  const Eigen::Vector3d up_lidar = R.inverse() * Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  const Eigen::Vector2d stated = up_lidar.head<2>();
  const std::size_t every = std::max<std::size_t>(1, returns_.size() / kTried);
  std::optional<Eigen::Vector2d> best;
  int most = 0;
  for (double lean = kLeast; lean <= stated.norm() + kMostOff; lean *= kStep) {
    for (double way = 0; way < 2 * M_PI; way += kTurn) {
      const Eigen::Vector2d u(lean * std::cos(way), lean * std::sin(way));
      if ((u - stated).norm() > kMostOff) continue;
      const Evidence found = evidence(u, 0, returns_.size(), every);
      if (found.sharp <= most || !found.is_ground()) continue;
      most = found.sharp;
      best = u;
    }
  }
  if (best) best = fitted(*best);
  const std::size_t all = returns_.size(), half = all / 2;
  if (!best || !evidence(*best, 0, all, 1).is_ground() ||
      !evidence(*best, 0, half, 1).stops_beams() || !evidence(*best, half, all, 1).stops_beams()) {
    return std::nullopt;
  }
  if ((*best - stated).norm() < kLeastOff || (*best - stated).norm() > kMostOff)
    return std::nullopt;
  const double up = std::copysign(std::sqrt(1 - best->squaredNorm()), up_lidar.z());
  const Eigen::Vector3d true_up_body = R * Eigen::Vector3d(best->x(), best->y(), up);
  const Eigen::AngleAxisd turn(
      Eigen::Quaterniond::FromTwoVectors(true_up_body, Eigen::Vector3d::UnitZ()));
  return MountingCorrection{turn.angle() * turn.axis(), Eigen::Vector3d::Zero()};
}

}  // namespace lamina
