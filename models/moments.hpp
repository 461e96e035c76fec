// Weighted moments of points: all that a plane residual ever needs to know of them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/plane.hpp>

namespace lamina {

/// Errors that all points of one observation share and that do not average out over its points:
/// calibration, correlated noise, quantisation. 1-sigma, at the centroid.
struct NoiseFloor {
  double sigma_rho = 0;   ///< m, along the normal
  double sigma_tilt = 0;  ///< rad, about each in-plane axis
  /// m, along the normal, of an error that changes slowly over the image: it tilts each in-plane
  /// axis by this over the points' rms extent along it, where that is more than sigma_tilt. A strip
  /// of wall leans far more easily than it turns.
  double sigma_bend = 0;
};

struct PlaneFit {
  Plane plane;
  /// Covariance of plane.about(centroid) in its boxplus tangent (tilt, tilt, rho): rad^2, m^2. For
  /// unit weights it is scaled by the residual variance, for weights 1/sigma^2 pass sigma 1.
  Eigen::Matrix3d covariance;
  Eigen::Vector3d eigenvalues;  ///< of scatter / weight, ascending, m^2
  double rms = 0;               ///< weighted root mean square distance of the points, m
};

/// Weighted count, mean and centred scatter of points. Sums are kept about the mean and never raw,
/// so that points 5 km from the origin fit as well as points at it.
/// A plane residual over N points equals one over their Moments exactly:
///   sum w_i (n.x_i - rho)^2 = p^T M p,  p = (n, -rho),  M = homogeneous().
class Moments {
 public:
  Moments() = default;
  /// From parts; scatter = sum w (x - mean)(x - mean)^T.
  Moments(double weight, const Eigen::Vector3d& mean, const Eigen::Matrix3d& scatter,
          std::int64_t count);
  /// From M = sum w [x;1][x;1]^T about the origin (4x4, symmetric). nullopt when M(3,3) is not > 0.
  static std::optional<Moments> from_homogeneous(const Eigen::Matrix4d& M, std::int64_t count = 0);

  /// Adds a point; ignores one that is not finite or whose weight is not > 0.
  void add(const Eigen::Vector3d& point, double weight = 1.0);
  /// Takes away a point that was added before.
  void remove(const Eigen::Vector3d& point, double weight = 1.0);
  void merge(const Moments& other);
  /// Takes away moments that were merged before.
  void subtract(const Moments& other);
  /// The moments of the same points in frame a.
  Moments transformed(const SE3& T_a_b) const;
  /// All weights times a factor.
  Moments scaled(double factor) const;

  double weight() const { return weight_; }
  const Eigen::Vector3d& mean() const { return mean_; }
  const Eigen::Matrix3d& scatter() const { return scatter_; }
  std::int64_t count() const { return count_; }
  bool empty() const { return count_ == 0 && weight_ <= 0; }

  /// sum w [x;1][x;1]^T, 4x4.
  Eigen::Matrix4d homogeneous() const;
  /// sum w (n.x - rho)^2.
  double cost(const Plane& plane) const;

  /// Least-squares plane, normal towards `seen_from`. nullopt for fewer than three points, points
  /// on a line (second eigenvalue below 1e-12 of the first), or anything not finite.
  /// With unit weights leave `sigma` empty: it is estimated from the residuals.
  std::optional<PlaneFit> fit_plane(const Eigen::Vector3d& seen_from,
                                    std::optional<double> sigma = std::nullopt) const;
  /// The best line through the mean (largest eigenvector). The covariance is that of (b1.d, b2.d,
  /// b1.x, b2.x): how far direction d and a point x = mean of the line are off along the two axes b
  /// of Plane::tangent_basis(direction): rad^2, m^2.
  struct LineFit {
    Eigen::Vector3d direction;
    double rms = 0;  ///< weighted root mean square distance of the points, m
    Eigen::Matrix4d covariance;
  };
  /// nullopt for fewer than two points or points all in one place. `sigma` as in fit_plane: noise
  /// of a unit-weight point in each direction across the line.
  std::optional<LineFit> fit_line(std::optional<double> sigma = std::nullopt) const;

  /// The moments a solver should use in place of these: the same information about the plane with
  /// this normal, less what the shared errors take away, and without the constant that points
  /// leave to their own best plane. Weights must be 1/sigma^2. Information along the normal becomes
  /// 1/(1/w + sigma_rho^2), that of each tilt 1/(1/s_i + max(sigma_tilt^2, sigma_bend^2 w/s_i)),
  /// the latter at most 0.1 rad squared; an axis on which the points have no extent (a scan
  /// segment's) keeps no information.
  Moments discounted(const Eigen::Vector3d& normal, const NoiseFloor& floor) const;

 private:
  double weight_ = 0;
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d scatter_ = Eigen::Matrix3d::Zero();
  std::int64_t count_ = 0;
};

}  // namespace lamina
