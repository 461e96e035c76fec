// How a level scanner's mounting is wrong, told by the wheels: its heading by the direction of
// travel, its place by turns.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include <lamina/frontend/motion/paired_motion.hpp>
#include <lamina/models/block_evidence.hpp>
#include <lamina/pipeline/calibration/mounting_evidence.hpp>

namespace lamina {

/// Of pieces of way as wheels and as scans have them. With a scanner said to be turned by psi and
/// to sit c (m, body axes) from where it does, and wheels that are short by s, a piece has
///   t_scans - R(half of what the yaws differ by) t_wheels = psi J t + s t + (I - R(yaw)) c,
/// J a quarter turn: a point off the wheels' middle is carried along by turns, and wheels that
/// drift turn half of it off. Robust least squares over psi, s and c (zero to 3 cm, so that ways
/// without turns tell of psi); pieces beyond 2.5 sigmas, by the median of the residuals, are left
/// out.
class MountingError {
 public:
  static constexpr double kPlacePrior = 0.03;  ///< m, 1-sigma: how far off a place is said

  void add(const PairedMotion& piece);

  /// psi (rad): to be taken off the stated heading. Sigma is the largest of what the residuals of
  /// single pieces make it, of what ten stretches of way do (slips are no white noise), and of what
  /// a slip of 0.02 m per sqrt(m) does (few pieces may agree by chance).
  struct Heading {
    double value = 0, sigma = 0;
    Adoption adoption;
  };
  struct Place {
    Eigen::Vector2d value = Eigen::Vector2d::Zero();  ///< c: to be taken off the stated place
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
    Adoption adoption;
  };
  /// nullopt for fewer than 20 pieces that travel 0.2 m or more.
  std::optional<Heading> heading() const;
  /// nullopt for fewer than six pieces that turn by 0.3 rad or more.
  std::optional<Place> place() const;
  /// Both as evidence, the place's prior taken out again, heading and place for themselves.
  MountingEvidence evidence() const;

 private:
  struct Row {
    Eigen::Matrix<double, 2, 4> A;  // psi, s, c
    Eigen::Vector2d d;
    double sigma;  // m, of each component: relative to other pieces
  };
  struct Estimate {
    Eigen::Vector4d value = Eigen::Vector4d::Zero();
    // Its covariance, from the residuals of pieces; from those of stretches; from the usual slip.
    Eigen::Matrix4d covariance, by_stretches, by_slip;
  };
  Estimate estimate() const;

  Adoption adoption(const std::vector<int>& asked, const std::vector<int>& beside,
                    const Eigen::Vector4d& start = Eigen::Vector4d::Zero()) const;

  std::vector<Row> rows_;
  BlockEvidence<4> blocks_;
  int travelling_ = 0, turning_ = 0;
};

}  // namespace lamina
