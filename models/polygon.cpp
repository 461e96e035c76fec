// Polygon arithmetic.
#include <lamina/models/polygon.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lamina {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double twice_area(const std::vector<Eigen::Vector2d>& v) {
  double sum = 0;
  // About the first vertex: no digits are lost far from the origin.
  for (std::size_t i = 1; i + 1 < v.size(); ++i) sum += cross(v[i] - v[0], v[i + 1] - v[0]);
  return sum;
}

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a,
                           const Eigen::Vector2d& b) {
  const Eigen::Vector2d d = b - a;
  const double length2 = d.squaredNorm();
  const double s = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0.0;
  return (p - a - s * d).norm();
}

// Keeps first and last of an open chain and what is further than the tolerance between them.
void simplify_chain(std::span<const Eigen::Vector2d> chain, double tolerance,
                    std::vector<Eigen::Vector2d>& out) {
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, chain.size() - 1}};
  std::vector<bool> keep(chain.size(), false);
  keep.front() = keep.back() = true;
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    double worst = tolerance;
    std::size_t at = 0;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double d = distance_to_segment(chain[i], chain[first], chain[last]);
      if (d > worst) {
        worst = d;
        at = i;
      }
    }
    if (at == 0) continue;
    keep[at] = true;
    open.push_back({first, at});
    open.push_back({at, last});
  }
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    if (keep[i]) out.push_back(chain[i]);
  }
}

}  // namespace

std::optional<Polygon> Polygon::from_vertices(std::vector<Eigen::Vector2d> vertices) {
  for (const auto& v : vertices) {
    if (!v.allFinite()) return std::nullopt;
  }
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  while (vertices.size() > 1 && vertices.front() == vertices.back()) vertices.pop_back();
  if (vertices.size() < 3) return std::nullopt;
  const double area = twice_area(vertices);
  double reach2 = 0;
  for (const auto& v : vertices) reach2 = std::max(reach2, (v - vertices[0]).squaredNorm());
  if (!(std::abs(area) > 1e-14 * reach2)) return std::nullopt;
  if (area < 0) std::reverse(vertices.begin(), vertices.end());
  Polygon polygon;
  polygon.vertices_ = std::move(vertices);
  return polygon;
}

std::optional<Polygon> Polygon::convex_hull(std::span<const Eigen::Vector2d> points) {
  std::vector<Eigen::Vector2d> sorted(points.begin(), points.end());
  for (const auto& p : sorted) {
    if (!p.allFinite()) return std::nullopt;
  }
  const auto less = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  };
  std::sort(sorted.begin(), sorted.end(), less);
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  if (sorted.size() < 3) return std::nullopt;
  std::vector<Eigen::Vector2d> hull;
  const auto extend = [&hull](const Eigen::Vector2d& p, std::size_t floor) {
    while (hull.size() >= floor + 2 &&
           cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0) {
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const auto& p : sorted) extend(p, 0);
  const std::size_t lower = hull.size() - 1;
  for (auto it = sorted.rbegin() + 1; it != sorted.rend(); ++it) extend(*it, lower);
  hull.pop_back();
  return from_vertices(std::move(hull));
}

double Polygon::area() const { return 0.5 * twice_area(vertices_); }

Eigen::Vector2d Polygon::centroid() const {
  if (vertices_.empty()) return Eigen::Vector2d::Zero();
  const Eigen::Vector2d& origin = vertices_[0];
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double total = 0;
  for (std::size_t i = 1; i + 1 < vertices_.size(); ++i) {
    const Eigen::Vector2d a = vertices_[i] - origin, b = vertices_[i + 1] - origin;
    const double area = cross(a, b);
    sum += area * (a + b) / 3.0;
    total += area;
  }
  return origin + sum / total;
}

bool Polygon::contains(const Eigen::Vector2d& p) const {
  const double rounding = 1e-12 * std::max(1.0, p.cwiseAbs().maxCoeff());
  bool inside = false;
  for (std::size_t i = 0, j = vertices_.size() - 1; i < vertices_.size(); j = i++) {
    const Eigen::Vector2d &a = vertices_[i], &b = vertices_[j];
    const bool near = (p.array() >= a.cwiseMin(b).array() - rounding).all() &&
                      (p.array() <= a.cwiseMax(b).array() + rounding).all();
    if (near && distance_to_segment(p, a, b) < rounding) return true;
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x()) {
      inside = !inside;
    }
  }
  return inside;
}

double Polygon::signed_distance(const Eigen::Vector2d& p) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0, j = vertices_.size() - 1; i < vertices_.size(); j = i++) {
    least = std::min(least, distance_to_segment(p, vertices_[j], vertices_[i]));
  }
  return contains(p) ? -least : least;
}

std::pair<Eigen::Vector2d, Eigen::Vector2d> Polygon::bounds() const {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (const auto& v : vertices_) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  return {low, high};
}

std::optional<Polygon> Polygon::clipped(const Polygon& convex) const {
  std::vector<Eigen::Vector2d> rest = vertices_;
  const auto& edges = convex.vertices_;
  for (std::size_t i = 0; i < edges.size() && !rest.empty(); ++i) {
    const Eigen::Vector2d &a = edges[i], &b = edges[(i + 1) % edges.size()];
    std::vector<Eigen::Vector2d> kept;
    for (std::size_t k = 0; k < rest.size(); ++k) {
      const Eigen::Vector2d &p = rest[k], &q = rest[(k + 1) % rest.size()];
      const double dp = cross(b - a, p - a), dq = cross(b - a, q - a);
      if (dp >= 0) kept.push_back(p);
      if ((dp >= 0) != (dq >= 0)) kept.push_back(p + dp / (dp - dq) * (q - p));
    }
    rest = std::move(kept);
  }
  return from_vertices(std::move(rest));
}

Polygon Polygon::simplified(double tolerance) const {
  if (vertices_.size() < 4) return *this;
  // Split at the two vertices furthest apart along the first axis of spread: both stay.
  std::size_t far = 0;
  for (std::size_t i = 1; i < vertices_.size(); ++i) {
    if ((vertices_[i] - vertices_[0]).squaredNorm() >
        (vertices_[far] - vertices_[0]).squaredNorm()) {
      far = i;
    }
  }
  std::vector<Eigen::Vector2d> result, chain(vertices_.begin(), vertices_.begin() + far + 1);
  simplify_chain(chain, tolerance, result);
  chain.assign(vertices_.begin() + far, vertices_.end());
  chain.push_back(vertices_[0]);
  simplify_chain(chain, tolerance, result);
  return from_vertices(std::move(result)).value_or(*this);
}

}  // namespace lamina
