// Pieces of way as rows of a small least-squares problem.
#include <lamina/pipeline/calibration/mounting_error.hpp>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include <lamina/frontend/motion/planar.hpp>

namespace lamina {
namespace {

constexpr double kTurns = 0.3, kTravels = 0.2;      // rad, m: what a piece tells by
constexpr double kBySlip = 0.02, kByMatch = 0.005;  // m per sqrt(m), m: relative weights
constexpr int kLeastTravelling = 20, kLeastTurning = 6;
constexpr double kOutlier = 2.5;                          // sigmas
constexpr double kHeadingPrior = 0.2, kScalePrior = 0.1;  // rad, 1: wide
constexpr int kRounds = 6;
constexpr std::size_t kStretches = 10;

Eigen::Matrix2d rotation(double angle) { return PlanarPose{0, 0, angle}.rotation(); }

}  // namespace

void MountingError::add(const PairedMotion& piece) {
  const PlanarPose wheels = planar_part(piece.wheels), scans = planar_part(piece.scans);
  const Eigen::Vector2d t =
      rotation(0.5 * wrap_angle(scans.yaw - wheels.yaw)) * wheels.translation();
  Row row;
  row.A.col(0) = Eigen::Vector2d(-t.y(), t.x());
  row.A.col(1) = t;
  row.A.rightCols<2>() = Eigen::Matrix2d::Identity() - rotation(scans.yaw);
  row.d = scans.translation() - t;
  row.sigma = std::sqrt(kBySlip * kBySlip * piece.way + kByMatch * kByMatch);
  rows_.push_back(row);
  for (int k = 0; k < 2; ++k) blocks_.add(piece.stamp, row.A.row(k), row.d(k), row.sigma);
  travelling_ += t.norm() > kTravels;
  turning_ += std::abs(scans.yaw) > kTurns;
}

MountingError::Estimate MountingError::estimate() const {
  Estimate result;
  double sigma = 1e9;  // of a residual in its row's own sigmas
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix4d H = 1e-9 * Eigen::Matrix4d::Identity();
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    std::array<Eigen::Vector4d, kStretches> pulls;
    pulls.fill(Eigen::Vector4d::Zero());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Row& row = rows_[i];
      const Eigen::Vector2d misfit = row.d - row.A * result.value;
      if (misfit.norm() > kOutlier * sigma * row.sigma) continue;
      const double weight = 1 / (row.sigma * row.sigma);
      H += weight * row.A.transpose() * row.A;
      b += weight * row.A.transpose() * row.d;
      pulls[i * kStretches / rows_.size()] += weight * row.A.transpose() * misfit;
    }
    Eigen::Matrix4d H_slip = H;
    H_slip.diagonal().tail<2>().array() += 1 / (kPlacePrior * kPlacePrior);
    if (round > 0) H.diagonal().tail<2>().array() += std::pow(sigma / kPlacePrior, 2);
    result.value = H.ldlt().solve(b);
    std::vector<double> misfits;
    for (const Row& row : rows_) {
      misfits.push_back((row.d - row.A * result.value).norm() / row.sigma);
    }
    const auto middle = misfits.begin() + static_cast<std::ptrdiff_t>(misfits.size() / 2);
    std::nth_element(misfits.begin(), middle, misfits.end());
    // The median length of two normal components is 1.1774 sigmas.
    sigma = std::max(1e-6, *middle / 1.1774);
    const Eigen::Matrix4d H_inverse = H.inverse();
    result.covariance = sigma * sigma * H_inverse;
    result.by_slip = H_slip.inverse();
    Eigen::Matrix4d scatter = Eigen::Matrix4d::Zero();
    for (const Eigen::Vector4d& pull : pulls) scatter += pull * pull.transpose();
    result.by_stretches = H_inverse * scatter * H_inverse * kStretches / (kStretches - 1.0);
  }
  return result;
}

// Whether data left out fit better with these of psi, s and c than without, all else free.
Adoption MountingError::adoption(const std::vector<int>& asked, const std::vector<int>& beside,
                                 const Eigen::Vector4d& start) const {
  // A place far beyond its prior is a hypothesis of its own, with one as wide as it is far: held to
  // zero by the narrow one, the facts that tell it are outliers.
  const double place = std::max(kPlacePrior, start.tail<2>().norm());
  const Eigen::Vector4d prior(kHeadingPrior, kScalePrior, place, place);
  const auto found = blocks_.solve(prior, asked, beside, start);
  return found ? found->adoption : Adoption();
}

std::optional<MountingError::Heading> MountingError::heading() const {
  if (travelling_ < kLeastTravelling) return std::nullopt;
  const Estimate found = estimate();
  const double variance =
      std::max({found.covariance(0, 0), found.by_stretches(0, 0), found.by_slip(0, 0)});
  return Heading{found.value(0), std::sqrt(variance), adoption({0}, {1, 2, 3})};
}

std::optional<MountingError::Place> MountingError::place() const {
  if (turning_ < kLeastTurning) return std::nullopt;
  const Estimate found = estimate();
  return Place{found.value.tail<2>(), found.covariance.bottomRightCorner<2, 2>(),
               adoption({2, 3}, {0, 1}, found.value)};
}

MountingEvidence MountingError::evidence() const {
  // Points are where the scanner has them, taken back by what it is said to be off by.
  MountingEvidence result;
  if (const auto turned = heading()) {
    result.information(2, 2) = 1 / (turned->sigma * turned->sigma);
    result.pull(2) = -result.information(2, 2) * turned->value;
  }
  if (const auto off = place()) {
    const Eigen::Matrix2d H = off->covariance.inverse();
    result.information.topLeftCorner<2, 2>() =
        H - Eigen::Matrix2d::Identity() / (kPlacePrior * kPlacePrior);
    result.pull.head<2>() = -H * off->value;
  }
  return result;
}

}  // namespace lamina
