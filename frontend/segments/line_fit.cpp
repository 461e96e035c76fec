// Gauss-Newton on ranges: two parameters, closed-form start.
#include <lamina/frontend/segments/line_fit.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {
constexpr int kIterations = 2;
// cos(88.9 deg): beams more oblique than that carry no usable information.
constexpr double kMinCosine = 0.02;

struct Line {
  double rho, nx, ny;
};

// One return against a line.
struct Residual {
  double cosine, sine, range, error, variance;
  bool usable;
};

Residual residual(const ScanPoints& points, int i, const Line& line) {
  Residual e;
  e.cosine = line.nx * points.c(i) + line.ny * points.s(i);
  e.sine = line.nx * points.s(i) - line.ny * points.c(i);
  e.usable = e.cosine > kMinCosine;
  if (!e.usable) return e;
  e.range = line.rho / e.cosine;
  e.error = points.r(i) - e.range;
  const double along = e.range * e.sine / e.cosine * points.sigma_a();
  e.variance = points.sigma_r() * points.sigma_r() + along * along;
  return e;
}

struct Normal {
  double aa = 0, ab = 0, bb = 0, ga = 0, gb = 0;
};

// Moments in the line's own coordinates: s along it, d off it.
struct LineMoments {
  double w = 0, s = 0, d = 0, ss = 0, sd = 0, dd = 0;
  int count = 0;
  double chi_squared = 0;
};

bool step(const ScanPoints& points, std::span<const int> indices, double gate, Line& line,
          Eigen::Matrix2d& covariance) {
  Normal n;
  for (const int i : indices) {
    const Residual e = residual(points, i, line);
    if (!e.usable || e.error * e.error > gate * e.variance) continue;
    const double w = 1 / e.variance, Ja = 1 / e.cosine, Jb = -e.range * e.sine / e.cosine;
    n.aa += w * Ja * Ja;
    n.ab += w * Ja * Jb;
    n.bb += w * Jb * Jb;
    n.ga += w * Ja * e.error;
    n.gb += w * Jb * e.error;
  }
  const double det = n.aa * n.bb - n.ab * n.ab;
  if (!(det > 1e-14 * n.aa * n.bb) || !std::isfinite(det)) return false;
  covariance << n.bb / det, -n.ab / det, -n.ab / det, n.aa / det;
  const double rho = line.rho + (n.bb * n.ga - n.ab * n.gb) / det;
  const double turn = (n.aa * n.gb - n.ab * n.ga) / det;
  if (!(rho > 0) || !(std::abs(turn) < 0.5)) return false;
  const double c = std::cos(turn), s = std::sin(turn);
  line = {rho, c * line.nx - s * line.ny, s * line.nx + c * line.ny};
  return true;
}

LineMoments moments_on(const ScanPoints& points, std::span<const int> indices, double gate,
                       const Line& line, double origin, std::vector<int>& rejected, int& first,
                       int& last) {
  LineMoments m;
  first = last = -1;
  for (const int i : indices) {
    const Residual e = residual(points, i, line);
    if (!e.usable || e.error * e.error > gate * e.variance) {
      rejected.push_back(i);
      continue;
    }
    if (first < 0) first = i;
    last = i;
    const double s = e.range * e.sine - origin, d = e.error * e.cosine;
    const double w = 1 / (e.variance * e.cosine * e.cosine);
    m.w += w;
    m.s += w * s;
    m.d += w * d;
    m.ss += w * s * s;
    m.sd += w * s * d;
    m.dd += w * d * d;
    ++m.count;
    m.chi_squared += e.error * e.error / e.variance;
  }
  return m;
}

Moments to_moments(const LineMoments& m, const Line& line, double origin, double weight_scale) {
  const Eigen::Vector3d normal(line.nx, line.ny, 0), along(-line.ny, line.nx, 0);
  const double s = m.s / m.w, d = m.d / m.w;
  const Eigen::Vector3d mean = (line.rho + d) * normal + (origin + s) * along;
  const double ss = m.ss - m.w * s * s, sd = m.sd - m.w * s * d, dd = m.dd - m.w * d * d;
  Eigen::Matrix3d scatter = ss * along * along.transpose() + dd * normal * normal.transpose();
  scatter += sd * (along * normal.transpose() + normal * along.transpose());
  return Moments(m.w * weight_scale, mean, scatter * weight_scale, m.count);
}

Eigen::Vector2d foot(const ScanPoints& points, int i, const Line& line) {
  const double range = line.rho / (line.nx * points.c(i) + line.ny * points.s(i));
  return {range * points.c(i), range * points.s(i)};
}
}  // namespace

std::optional<ScanSegment> fit_line(const ScanPoints& points, std::span<const int> indices,
                                    const InverseRangeSums& sums, double outlier_sigma,
                                    std::vector<int>& rejected) {
  if (indices.size() < 3) return std::nullopt;
  double A = 0, B = 0;
  if (!sums.solve(A, B)) return std::nullopt;
  const double norm = std::hypot(A, B);
  Line line{1 / norm, A / norm, B / norm};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  const double gate = outlier_sigma * outlier_sigma;
  for (int k = 0; k < kIterations; ++k) {
    if (!step(points, indices, k == 0 ? 4 * gate : gate, line, covariance)) return std::nullopt;
  }
  const int middle = indices[indices.size() / 2];
  const double origin =
      points.r(middle) * (line.nx * points.s(middle) - line.ny * points.c(middle));
  int first = -1, last = -1;
  const LineMoments m = moments_on(points, indices, gate, line, origin, rejected, first, last);
  if (m.count < 3 || !covariance.allFinite()) return std::nullopt;

  ScanSegment segment;
  segment.rho = line.rho;
  segment.theta = std::atan2(line.ny, line.nx);
  segment.start = foot(points, first, line);
  segment.end = foot(points, last, line);
  segment.first_beam = points.beam(first);
  segment.last_beam = points.beam(last);
  segment.count = m.count;
  segment.chi_squared = m.chi_squared;
  const double degrees = m.count - 2, reduced = m.chi_squared / degrees;
  const double inflation = reduced > 1 + 2 * std::sqrt(2 / degrees) ? reduced : 1.0;
  segment.covariance = inflation * covariance;
  segment.moments = to_moments(m, line, origin, 1 / inflation);
  return segment;
}

}  // namespace lamina
