// Circle fits in polar form: algebraic for columns, by maximum likelihood for walls that bend.
#include <lamina/frontend/segments/arc_fit.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace lamina {
namespace {
constexpr int kIterations = 4;
// d(residual)/d(range) vanishes where the beam touches the circle: hold it off zero.
constexpr double kMinGain = 0.03;

double gain_of(double r, double F) { return std::max(kMinGain, std::abs(1 - F / (r * r))); }

// r + D cos a + E sin a + F / r = 0, reweighted to range errors [Kasa1976].
std::optional<Arc> algebraic_fit(const ScanPoints& points, std::span<const int> indices,
                                 double cap) {
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
  const double square = circle.head<2>().squaredNorm() / 4 - circle(2);  // of the radius
  if (!(square > 0)) return std::nullopt;
  Arc arc{0, 1 / std::sqrt(square), 0, true};
  const double variance = points.sigma_r() * points.sigma_r();
  for (const int i : indices) {
    const double r = points.r(i);
    const double f = r + circle(0) * points.c(i) + circle(1) * points.s(i) + circle(2) / r;
    const double e = f / gain_of(r, circle(2));
    arc.cost += std::min(cap, e * e / variance);
  }
  return arc;
}

// The circle K r^2 + (A cos a + B sin a) r = 1, a line where K is 0: the nearer place where a beam
// meets it. Angles count from the run's middle beam.
class BentLine {
 public:
  BentLine(const ScanPoints& points, std::span<const int> indices, double cap)
      : points_(points), indices_(indices), cap_(cap) {
    const int middle = indices[indices.size() / 2];
    cos_ = points.c(middle);
    sin_ = points.s(middle);
    best_.x = {points.q(middle), 0, 0};
  }

  // Gauss-Newton. An algebraic fit is biased where noise is not small against the bend, and loses
  // to lines that are worse.
  Arc fit() {
    constexpr int kSteps = 4;
    const double all = std::numeric_limits<double>::infinity();
    descend(kSteps, all);  // the start is no more than that: no return is off it yet
    descend(kSteps, cap_);
    const Eigen::Vector3d& x = best_.x;
    const double square = x.head<2>().squaredNorm() + 4 * x(2);
    Arc arc{best_.cost, 2 * std::abs(x(2)) / std::sqrt(std::max(square, 1e-12)), 0, false};
    // Of K, whatever the line does; K is half the curvature over the line's distance.
    const Eigen::Matrix2d lines = best_.H.topLeftCorner<2, 2>();
    const Eigen::Vector2d tie = best_.H.topRightCorner<2, 1>();
    const double of_bend = best_.H(2, 2) - tie.dot(lines.ldlt().solve(tie));
    arc.information = std::max(0.0, of_bend) * square / 4;
    return arc;
  }

 private:
  struct State {
    Eigen::Vector3d x = Eigen::Vector3d::Zero();  // A, B, K
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double cost = 0;
  };

  State at(const Eigen::Vector3d& x, double cap) const {
    State state;
    state.x = x;
    const double weight = 1 / (points_.sigma_r() * points_.sigma_r());
    for (const int i : indices_) {
      const double c = points_.c(i) * cos_ + points_.s(i) * sin_;
      const double s = points_.s(i) * cos_ - points_.c(i) * sin_;
      const double g = x(0) * c + x(1) * s, square = g * g + 4 * x(2);
      const double root = std::sqrt(std::max(0.0, square));
      if (!(square > 0) || !(g + root > 0)) {  // this beam misses the circle
        state.cost = std::numeric_limits<double>::infinity();
        return state;
      }
      const double r = 2 / (g + root), e = points_.r(i) - r;
      state.cost += std::min(cap, weight * e * e);
      if (weight * e * e > cap) continue;
      const Eigen::Vector3d J = -r / root * Eigen::Vector3d(c, s, r);
      state.H += weight * J * J.transpose();
      state.b += weight * e * J;
    }
    return state;
  }

  void descend(int steps, double cap) {
    constexpr int kHalvings = 4;
    best_ = at(best_.x, cap);
    for (int k = 0; k < steps; ++k) {
      Eigen::Vector3d d = best_.H.ldlt().solve(best_.b);
      bool better = false;
      for (int i = 0; i < kHalvings && !better && d.allFinite(); ++i, d *= 0.5) {
        const State next = at(best_.x + d, cap);
        better = next.cost < best_.cost;
        if (better) best_ = next;
      }
      if (!better) return;
    }
  }

  const ScanPoints& points_;
  std::span<const int> indices_;
  double cap_, cos_ = 1, sin_ = 0;
  State best_;
};

}  // namespace

std::optional<Arc> fit_arc(const ScanPoints& points, std::span<const int> indices, double cap) {
  if (indices.size() < 5) return std::nullopt;
  const std::optional<Arc> column = algebraic_fit(points, indices, cap);
  Arc arc = BentLine(points, indices, cap).fit();
  if (!std::isfinite(arc.cost)) return column;
  if (column) arc.cost = std::min(arc.cost, column->cost);
  return arc;
}

}  // namespace lamina
