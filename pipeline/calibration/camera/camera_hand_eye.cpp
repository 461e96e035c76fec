// Pieces of way as rows of a small least-squares problem.
#include <lamina/models/median.hpp>
#include <lamina/pipeline/calibration/camera/camera_hand_eye.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>

namespace lamina {
namespace {

using Vector = WheelErrors::Vector;
using Matrix = WheelErrors::Matrix;
constexpr double kDelta = 1e-4;  // of an error, for differences
constexpr double kHeld = 10;    // of the wheels' variance: directions an image knows worse are open
constexpr double kOutlier = 9;  // chi-squared
constexpr double kLeastNoise = 0.1;  // of the stated variance
constexpr std::size_t kLeastFacts = 30;
constexpr double kMedianSquare = 0.455;  // of a normal of variance 1
constexpr int kRounds = 6;
// What images' slow errors may do to the camera's heading (rad) and place (m) however long the way.
constexpr double kSharedTurn = 0.004, kSharedPlace = 0.004;

SE3 composed(const std::vector<SE3>& increments, const Vector& errors) {
  SE3 T;
  for (const SE3& increment : increments) T = T * corrected(increment, errors);
  return T;
}

// Translation across the floor and yaw of a tangent.
constexpr int kPlanar[] = {0, 1, 5};

Eigen::Vector3d planar(const Vector6d& v) { return {v(kPlanar[0]), v(kPlanar[1]), v(kPlanar[2])}; }

Eigen::Matrix3d planar(const Matrix6d& m) {
  Eigen::Matrix3d p;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) p(i, j) = m(kPlanar[i], kPlanar[j]);
  }
  return p;
}

}  // namespace

CameraAgainstWheels::CameraAgainstWheels(const Eigen::Vector2d& camera_place,
                                         const DepthOdometryOptions& options)
    : options_(options), camera_place_(camera_place) {}

void CameraAgainstWheels::add(Timestamp stamp, const std::optional<Increment>& by_wheels,
                              const DepthMotion& by_image) {
  const bool measured = by_image.status == ScanMotion::Status::kTracked ||
                        by_image.status == ScanMotion::Status::kDegenerate;
  if (!by_wheels || !measured || by_image.doubtful) {
    piece_.reset();
  } else if (piece_) {
    const SE3& T = by_wheels->T_from_to;
    const Matrix6d back = T.inverse().adjoint();
    piece_->covariance = back * piece_->covariance * back.transpose() + by_wheels->covariance;
    piece_->wheels.push_back(T);
    piece_->T_images = piece_->T_images * by_image.T_prev_curr_body;
    if (by_image.key_frame) take(stamp, by_image);
  }
  if (by_image.key_frame) piece_ = Piece{};
}

// The piece ends with a key frame, which was matched with the one it began with (and an older one
// where that overlaps).
void CameraAgainstWheels::take(Timestamp stamp, const DepthMotion& by_image) {
  const int block = blocks_.of(stamp);
  const SE3 T_wheels_images = composed(piece_->wheels, Vector::Zero()).inverse() * piece_->T_images;
  Matrix6d information = by_image.image_information;
  information.diagonal().array() += 1;  // a metre, a radian: what is open stays finite
  const Matrix6d of_image = information.inverse();
  const Eigen::Vector3d off =
      planar(Vector6d(T_wheels_images.log() + of_image * by_image.image_pull));
  Eigen::Matrix<double, 3, WheelErrors::kCount> J;
  for (int k = 0; k < WheelErrors::kCount; ++k) {
    const Vector d = kDelta * Vector::Unit(k);
    J.col(k) =
        planar((composed(piece_->wheels, -d).inverse() * composed(piece_->wheels, d)).log()) /
        (2 * kDelta);
  }
  const double metres = piece_->T_images.translation().norm();
  const double radians = piece_->T_images.so3().log().norm();
  const double t = options_.sigma_translation + options_.sigma_motion * metres;
  const double r = options_.sigma_rotation + options_.sigma_motion * radians;
  Eigen::Matrix3d expected = planar(piece_->covariance);
  expected.diagonal() += Eigen::Vector3d(t * t, t * t, r * r);
  // In units of what is expected: by component where an image knows all three, else along the axes
  // of what it knows, each counted to the component it is nearest to.
  const Eigen::Matrix3d L = expected.llt().matrixL();
  const Eigen::Matrix3d whiten = L.inverse(),
                        image = whiten * planar(of_image) * whiten.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(image);
  Eigen::Matrix3d directions = axes.eigenvectors();
  if (1 + axes.eigenvalues()(2) <= kHeld) directions.setIdentity();
  for (int k = 0; k < 3; ++k) {
    const Eigen::RowVector3d direction = directions.col(k).transpose();
    const double variance = 1 + direction.dot(direction * image);
    if (variance > kHeld) continue;
    int component = 0;
    direction.cwiseAbs().maxCoeff(&component);
    const Eigen::RowVector3d to_fact = direction * whiten / std::sqrt(variance);
    facts_.push_back({(to_fact * J).transpose(), to_fact * off, component, block});
  }
}

bool CameraAgainstWheels::Fit::holds(const Fact& fact) const {
  return std::pow(fact.value - fact.row.dot(errors.value), 2) <= kOutlier * noise(fact.component);
}

CameraAgainstWheels::Fit CameraAgainstWheels::fit(const WheelPrior& prior) const {
  Fit result{{}, Eigen::Vector3d::Constant(1e9)};  // at first every fact counts
  for (int round = 0; round < kRounds; ++round) {
    Matrix H = prior.information();
    Vector b = Vector::Zero();
    for (const Fact& fact : facts_) {
      if (!result.holds(fact)) continue;
      const double variance = round == 0 ? 1 : result.noise(fact.component);
      H += fact.row * fact.row.transpose() / variance;
      b += fact.row * fact.value / variance;
    }
    result.errors.value = H.ldlt().solve(b);
    result.errors.covariance = H.inverse();
    std::array<std::vector<double>, 3> squares;
    for (const Fact& fact : facts_) {
      squares[static_cast<std::size_t>(fact.component)].push_back(
          std::pow(fact.value - fact.row.dot(result.errors.value), 2));
    }
    for (int k = 0; k < 3; ++k) {
      result.noise(k) =
          std::max(kLeastNoise, median(squares[static_cast<std::size_t>(k)]) / kMedianSquare);
    }
  }
  const Vector shared = WheelErrors::of(0, 0, 0, kSharedTurn, kSharedPlace, kSharedPlace);
  result.errors.covariance.diagonal() += shared.cwiseAbs2();
  return result;
}

std::vector<QuadraticBlock> CameraAgainstWheels::by_blocks(const Fit& fit) const {
  std::vector<QuadraticBlock> result(static_cast<std::size_t>(blocks_.count()),
                                     {Matrix::Zero(), Vector::Zero()});
  for (const Fact& fact : facts_) {
    if (!fit.holds(fact)) continue;
    QuadraticBlock& block = result[static_cast<std::size_t>(fact.block)];
    block.H += fact.row * fact.row.transpose() / fit.noise(fact.component);
    block.b += fact.row * fact.value / fit.noise(fact.component);
  }
  return result;
}

MountingEvidence CameraAgainstWheels::evidence() const {
  MountingEvidence result;
  if (facts_.size() < kLeastFacts) return result;
  const WheelPrior prior(camera_place_);
  const WheelErrors errors = fit(prior).errors;
  // The frame of the camera is turned by -direction against the wheels'.
  Eigen::Matrix3d to_e;
  to_e << 0, 1, 0, 0, 0, 1, -1, 0, 0;
  const auto of_mounting = [&](const Matrix& C) {
    return Eigen::Matrix3d(to_e * C.bottomRightCorner<3, 3>() * to_e.transpose());
  };
  // Of images alone: less the prior, which counts in the fit as it does here.
  const Eigen::Matrix3d H = of_mounting(errors.covariance).inverse();
  const Eigen::Matrix3d H_prior = of_mounting(Matrix(prior.information().inverse())).inverse();
  result.information = H - H_prior;
  result.pull = H * (to_e * errors.value.tail<3>());
  return result;
}

std::optional<CorrectedMounting> CameraAgainstWheels::correction() const {
  if (facts_.size() < kLeastFacts) return std::nullopt;
  WheelPrior prior(camera_place_), stated(camera_place_);
  prior.settle([&] { return std::optional(fit(prior).errors); }, 0);
  stated.fix_direction();
  stated.fix_place();
  const Fit found = fit(prior);
  const JudgedBlocks judged = judge(by_blocks(found), stated.information(), prior.information());
  if (!judged.adoption.adopted) return std::nullopt;
  const Vector sigma =
      found.errors.covariance.diagonal().cwiseMax(judged.covariance.diagonal()).cwiseSqrt();
  return CorrectedMounting{
      "camera",         "images against wheels", prior.correction(found.errors.value),
      {0, 0, sigma(3)}, {sigma(4), sigma(5), 0}, judged.adoption.gain};
}

}  // namespace lamina
