// Sums of (u, v, 1, disparity): planes are linear in disparity, so ten sums fit one exactly.
#pragma once

#include <Eigen/Core>
#include <optional>

#include <lamina/models/moments.hpp>
#include <lamina/models/plane.hpp>
#include <lamina/sensors/calibration.hpp>

namespace lamina {

/// d = x u + y v + z, (u, v) in pixels from the principal point, d in pixels of disparity.
using DisparityPlane = Eigen::Vector3d;

/// The geometry that turns disparity planes into planes: focal lengths and focal * baseline.
struct DisparityGeometry {
  double fx = 1, fy = 1, cx = 0, cy = 0;
  double focal_baseline = 1;

  static DisparityGeometry of(const DepthCamera& camera);
  /// With P = fb/d (u/fx, v/fy, 1): n.P = rho gives d = (fb / rho)(n_x u/fx + n_y v/fy + n_z).
  DisparityPlane disparity_plane(const Plane& plane_camera) const;
  /// The inverse; the normal points to the camera, so rho < 0. nullopt for a plane at infinity.
  std::optional<Plane> plane(const DisparityPlane& p) const;
  /// Camera-frame point at (u, v) from the principal point with disparity d > 0 (m).
  Eigen::Vector3d point(double u, double v, double d) const {
    const double z = focal_baseline / d;
    return {u / fx * z, v / fy * z, z};
  }
};

/// Sums over pixels, (u, v) from the principal point.
struct DisparitySums {
  double n = 0, u = 0, v = 0, d = 0, uu = 0, uv = 0, vv = 0, ud = 0, vd = 0, dd = 0;

  void add(double pu, double pv, double pd) {
    n += 1;
    u += pu;
    v += pv;
    d += pd;
    uu += pu * pu;
    uv += pu * pv;
    vv += pv * pv;
    ud += pu * pd;
    vd += pv * pd;
    dd += pd * pd;
  }
  DisparitySums& operator+=(const DisparitySums& o) {
    n += o.n;
    u += o.u;
    v += o.v;
    d += o.d;
    uu += o.uu;
    uv += o.uv;
    vv += o.vv;
    ud += o.ud;
    vd += o.vd;
    dd += o.dd;
    return *this;
  }
  DisparitySums& operator-=(const DisparitySums& o) {
    n -= o.n;
    u -= o.u;
    v -= o.v;
    d -= o.d;
    uu -= o.uu;
    uv -= o.uv;
    vv -= o.vv;
    ud -= o.ud;
    vd -= o.vd;
    dd -= o.dd;
    return *this;
  }

  /// The same pixels, measured from a place that lies (u, v, d) before the present origin.
  DisparitySums shifted(double du, double dv, double dd) const;
  /// Least squares; nullopt for fewer than three pixels or pixels (almost) on a line.
  std::optional<DisparityPlane> fit() const;
  /// Sum of squared residuals (px^2), not below 0.
  double sse(const DisparityPlane& p) const;
  /// Mean over the pixels of (p(u, v))^2: how large a difference of planes is here (px^2).
  double mean_square(const DisparityPlane& p) const;
  /// Covariance of the fitted plane for `variance` px^2 a pixel; zero when it cannot be inverted.
  Eigen::Matrix3d covariance(double variance) const;
  /// Exact moments of the pixels' points with weights 1/sigma^2 along the plane's normal:
  /// an error of d moves a point on the plane by -rho Z / fb along it, so
  /// w [P; 1][P; 1]^T = [fb r; d][fb r; d]^T / (rho sigma_d)^2 with r = (u/fx, v/fy, 1).
  /// `variance` is that of one pixel times the pixels that make one independent measurement.
  std::optional<Moments> moments(const DisparityGeometry& g, const Plane& plane,
                                 double variance) const;
};

}  // namespace lamina
