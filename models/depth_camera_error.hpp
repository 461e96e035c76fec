// Errors of a depth camera that keep planes plane, in terms of points and planes.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include <lamina/models/moments.hpp>
#include <lamina/models/plane.hpp>

namespace lamina {

/// A camera that errs in inverse depth by a constant and two slopes, at pixel (x, y) = (X, Y) / Z:
///   1/Z measured = 1/Z true + e . (x, y, 1),
/// and whose focal length is stated (1 + focal) times as long as it is:
///   (x, y) true = (1 + focal) (x, y) measured.
/// Constants and slopes of disparity over the image do the one, e being theirs over f b; so does an
/// unnoticed turn of one camera of two. The map between points is projective, planes stay planes:
///   point true = D point / (1 - e . point),   (n, rho) true ~ (D^-1 (n - rho e), rho),
/// D = diag(1 + focal, 1 + focal, 1), all in the camera's optical frame. Through no single image
/// the errors show.
struct DepthCameraError {
  Eigen::Vector3d e = Eigen::Vector3d::Zero();  ///< 1/m: across, down, constant
  double focal = 0;

  /// The true point of a measured one. Where the error is as large as the inverse depth there is
  /// none: what comes out is not finite or behind the camera.
  Eigen::Vector3d corrected(const Eigen::Vector3d& point) const {
    return D().cwiseProduct(point) / (1 - e.dot(point));
  }
  /// The true plane of a measured one; one through the camera stays so.
  Plane corrected(const Plane& plane) const {
    const Eigen::Vector3d n = (plane.normal() - plane.rho() * e).cwiseQuotient(D());
    const double length = n.norm();
    return Plane(n / length, plane.rho() / length);
  }
  /// The moments of corrected points, to first order of the error about the plane the points lie
  /// on; as they are where that gives none.
  Moments corrected(const Moments& moments) const {
    Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
    A.topLeftCorner<3, 3>() = D().asDiagonal();
    A.bottomLeftCorner<1, 3>() = -e.transpose();
    const auto result =
        Moments::from_homogeneous(A * moments.homogeneous() * A.transpose(), moments.count());
    return result ? *result : moments;
  }
  /// What makes measured points of true ones.
  DepthCameraError inverse() const { return {-e.cwiseQuotient(D()), -focal / (1 + focal)}; }

 private:
  Eigen::Vector3d D() const { return {1 + focal, 1 + focal, 1}; }
};

}  // namespace lamina
