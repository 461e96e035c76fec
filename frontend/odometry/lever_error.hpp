// Where a scanner sits, told by turns: a point off the wheels' middle is carried along.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include <lamina/frontend/odometry/paired_motion.hpp>

namespace lamina {

/// Gathers motions of one body as wheels and as scan matching have them, over pieces of half a
/// metre or 0.6 rad. With a scanner said to sit at `c` (m, body axes) from where it sits, turned by
/// a small psi, and wheels that are short by s, a piece that turns by yaw has
///   t_scans - R(half of what the yaws differ by) t_wheels = psi J t + s t + (I - R(yaw)) c,
/// J a quarter turn. Least squares over psi, s and c; pieces beyond 2.5 sigmas (by the median of
/// the residuals) are left out.
class LeverError {
 public:
  struct Result {
    Eigen::Vector2d value = Eigen::Vector2d::Zero();  ///< c: to be taken off the stated place
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  };

  /// The body's motion since the last call, by both; nullopt where one of them does not tell it:
  /// the piece begins anew.
  void add(const std::optional<SE3>& by_wheels, const std::optional<SE3>& by_scans);
  /// nullopt for fewer than six pieces that turn by 0.3 rad or more.
  std::optional<Result> result() const;

 private:
  struct Piece {
    Eigen::Matrix<double, 2, 4> A;  ///< psi, s, c
    Eigen::Vector2d d;
    double sigma;  ///< m, of each component: relative to other pieces
    bool turns;
  };
  std::vector<Piece> pieces_;
  PairedMotion piece_;  // since it began
};

}  // namespace lamina
