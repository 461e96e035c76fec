// Circle fit in polar form.
#include <lamina/frontend/segments/arc_fit.hpp>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lamina {
namespace {
constexpr int kIterations = 4;
// d(residual)/d(range) vanishes where the beam touches the circle: hold it off zero.
constexpr double kMinGain = 0.03;

double gain_of(double r, double F) { return std::max(kMinGain, std::abs(1 - F / (r * r))); }
}  // namespace

std::optional<double> arc_cost(const ScanPoints& points, std::span<const int> indices, double cap) {
  if (indices.size() < 5) return std::nullopt;
  Eigen::Vector3d circle = Eigen::Vector3d::Zero();
  for (int k = 0; k < kIterations; ++k) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (const int i : indices) {
      const double r = points.r(i), gain = k == 0 ? 1.0 : gain_of(r, circle(2));
      const Eigen::Vector3d J(points.c(i), points.s(i), 1 / r);
      H += J * J.transpose() / (gain * gain);
      g -= J * r / (gain * gain);
    }
    const double determinant = H.determinant();
    if (!(std::abs(determinant) > 1e-18 * H(0, 0) * H(1, 1) * H(2, 2) + 1e-300)) {
      return std::nullopt;
    }
    circle = H.inverse() * g;
    if (!circle.allFinite()) return std::nullopt;
  }
  double cost = 0;
  const double variance = points.sigma_r() * points.sigma_r();
  for (const int i : indices) {
    const double r = points.r(i);
    const double f = r + circle(0) * points.c(i) + circle(1) * points.s(i) + circle(2) / r;
    const double e = f / gain_of(r, circle(2));
    cost += std::min(cap, e * e / variance);
  }
  return cost;
}

}  // namespace lamina
