// Iteratively reweighted least squares over ground lines.
#include <lamina/pipeline/calibration/ground_lines.hpp>

#include <Eigen/Dense>
#include <cmath>

#include <lamina/models/block_evidence.hpp>

namespace lamina {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
// A line may lean this much and lie this far off: three sigmas of the prior, and a step's height.
constexpr double kMostSlope = 5 * kDegree;
constexpr double kMostHeight = 0.1;   // m
constexpr double kLeastLength = 0.5;  // m
constexpr std::size_t kLeastScans = 30;
// Of one line against the ground as a whole: bumps, and the fit's own noise.
constexpr double kSlopeSigma = 0.3 * kDegree;
constexpr double kHeightSigma = 0.01;  // m
// Priors of a calibration.
constexpr double kLeanPrior = 1.5 * kDegree;
constexpr double kHeightPrior = 0.02;  // m
// Corrections below both are not worth being believed.
constexpr double kLeastLean = 0.1 * kDegree;
constexpr double kLeastRise = 0.005;  // m

// Of a line's slope and height, by the scanner's lean (two angles) and rise.
template <class Line>
Eigen::Matrix<double, 2, 3> jacobian(const Line& line) {
  const Eigen::Vector3d& d = line.direction_body;
  const Eigen::Vector3d p = line.middle_body - line.scanner_body;
  Eigen::Matrix<double, 2, 3> J;
  J << d.y(), -d.x(), 0,  //
      p.y(), -p.x(), 1;
  return J;
}

}  // namespace

void GroundLines::add(const Observations& observations) {
  ++scans_;
  const SE3& T = observations.T_body_sensor;
  std::optional<Line> longest;
  double length = kLeastLength;
  for (const SegmentObservation& o : observations.segments) {
    const Eigen::Vector3d start = T * Eigen::Vector3d(o.segment.start.x(), o.segment.start.y(), 0);
    const Eigen::Vector3d end = T * Eigen::Vector3d(o.segment.end.x(), o.segment.end.y(), 0);
    const Eigen::Vector3d middle = 0.5 * (start + end), way = end - start;
    const double reach = (middle - T.translation()).head<2>().norm();
    if (way.norm() < length || std::abs(way.z()) > std::sin(kMostSlope) * way.norm() ||
        std::abs(middle.z()) > kMostHeight + std::tan(kMostSlope) * reach) {
      continue;
    }
    length = way.norm();
    longest = Line{way.normalized(), middle, T.translation(), observations.stamp};
  }
  if (longest) lines_.push_back(*longest);
}

// Whether lines left out lie on the ground better with the correction by the others.
bool GroundLines::adopted() const {
  BlockEvidence<3> evidence;
  for (const Line& line : lines_) {
    const Eigen::Vector3d& d = line.direction_body;
    const Eigen::Vector3d p = line.middle_body - line.scanner_body;
    evidence.add(line.stamp, {-d.y(), d.x(), 0}, d.z(), kSlopeSigma);
    evidence.add(line.stamp, {-p.y(), p.x(), -1}, line.middle_body.z(), kHeightSigma);
  }
  const auto found = evidence.solve({kLeanPrior, kLeanPrior, kHeightPrior}, {0, 1, 2});
  return found && found->adoption.adopted;
}

std::optional<MountingCorrection> GroundLines::correction() const {
  if (lines_.size() < kLeastScans || 2 * lines_.size() < scans_) return std::nullopt;
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  const Eigen::Array2d sigma(kSlopeSigma, kHeightSigma);
  Eigen::Matrix3d H;
  double inliers = 0;
  // From wide to narrow: lines on steps and kerbs fall out by and by.
  constexpr int kRounds = 12;
  for (int round = 0; round < kRounds; ++round) {
    const double widen = std::max(1.0, 8.0 / (1 + round));
    H.setZero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    inliers = 0;
    for (const Line& line : lines_) {
      const Eigen::Matrix<double, 2, 3> J = jacobian(line);
      const Eigen::Vector2d r =
          Eigen::Vector2d(line.direction_body.z(), line.middle_body.z()) + J * x;
      const Eigen::Array2d whitened = r.array() / sigma;
      const double cauchy = 1 / (1 + whitened.matrix().squaredNorm() / (9 * widen * widen));
      const Eigen::Vector2d weights = (cauchy / sigma.square()).matrix();
      H += J.transpose() * weights.asDiagonal() * J;
      g += J.transpose() * weights.cwiseProduct(r);
      if (whitened.matrix().squaredNorm() < 9 * widen * widen) ++inliers;
    }
    // Scans next to each other see the same ground: all of them count as ten lines.
    const double share = 10.0 / static_cast<double>(lines_.size());
    const Eigen::Array3d prior(kLeanPrior, kLeanPrior, kHeightPrior);
    const Eigen::Vector3d information = prior.square().inverse().matrix();
    H = (share * H).eval();
    H.diagonal() += information;
    g = (share * g + information.cwiseProduct(x)).eval();
    x -= H.ldlt().solve(g);
  }
  if (2 * inliers < static_cast<double>(lines_.size()) || !x.allFinite()) return std::nullopt;
  if ((x.head<2>().norm() < kLeastLean && std::abs(x.z()) < kLeastRise) || !adopted())
    return std::nullopt;
  return MountingCorrection{{x.x(), x.y(), 0}, {0, 0, x.z()}};
}

}  // namespace lamina
