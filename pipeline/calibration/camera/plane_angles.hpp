// What the angles between the planes of an image tell of its bend.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace lamina {

/// A plane as one image shows it. On the ray (x, y, 1) its disparity is q . (x, y, 1), so that q is
/// along its normal, longer the nearer it is.
struct ImagePlane {
  Eigen::Vector3d q = Eigen::Vector3d::Zero();           ///< px
  Eigen::Matrix3Xd by_bend;                              ///< dq / d coefficients of the bend
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of q, px^2
};

/// Floors, walls and furniture mostly stand square to each other or are parallel. A bend turns
/// planes, each by what it is where the plane is seen, so that right angles that look wrong in the
/// same way all over a recording tell it, its constant and slopes as well: q less `by_bend` times
/// the coefficients is the plane without the bend. Every two planes of an image that are within
/// some degrees of square or parallel take part, robustly: what is built askew does not count.
class PlaneAngles {
 public:
  void add(std::vector<ImagePlane> image);
  /// Sum of robust chi-squared that the coefficients leave; angles far from right ones count as
  /// outliers do. Images in a row see the same walls: all of them together count as a few.
  double cost(const Eigen::VectorXd& coefficients) const;
  /// Adds the Gauss-Newton system of cost() at `coefficients` for a step: H step = -g.
  void linearize(const Eigen::VectorXd& coefficients, Eigen::MatrixXd& H, Eigen::VectorXd& g) const;

 private:
  template <class F>
  void for_each_pair(const Eigen::VectorXd& coefficients, F f) const;
  double share() const;  ///< of what a pair tells when it stands alone

  std::vector<std::vector<ImagePlane>> images_;
};

}  // namespace lamina
