// Ears off, one by one.
#include <lamina/models/ear_clipping.hpp>

#include <limits>
#include <numeric>

namespace lamina {
namespace {

using Outline = std::vector<Eigen::Vector2d>;

// Twice the area to the left of a, b, c.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

double twice_area(const Outline& v) {
  double sum = 0;
  for (std::size_t i = 1; i + 1 < v.size(); ++i) sum += turn(v[0], v[i], v[i + 1]);
  return sum;
}

// What is left of an outline, counter-clockwise.
class Rest {
 public:
  Rest(const Outline& outline, bool reversed) : outline_(outline), left_(outline.size()) {
    std::iota(left_.begin(), left_.end(), 0);
    if (reversed) left_ = {left_.rbegin(), left_.rend()};
  }

  std::size_t size() const { return left_.size(); }
  std::array<std::size_t, 3> corner(std::size_t k) const {
    const std::size_t n = left_.size();
    return {left_[(k + n - 1) % n], left_[k], left_[(k + 1) % n]};
  }
  double turn_at(std::size_t k) const {
    const auto [a, b, c] = corner(k);
    return turn(outline_[a], outline_[b], outline_[c]);
  }
  // No other vertex in the triangle at k, its border (but for its own corners) included.
  bool is_ear(std::size_t k) const {
    const auto [a, b, c] = corner(k);
    const Eigen::Vector2d &pa = outline_[a], &pb = outline_[b], &pc = outline_[c];
    for (const std::size_t other : left_) {
      const Eigen::Vector2d& p = outline_[other];
      if (p == pa || p == pb || p == pc) continue;
      if (turn(pa, pb, p) >= 0 && turn(pb, pc, p) >= 0 && turn(pc, pa, p) >= 0) return false;
    }
    return true;
  }
  void clip(std::size_t k) { left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(k)); }

 private:
  const Outline& outline_;
  std::vector<std::size_t> left_;
};

// The next ear from `start` on; one without area, else the smallest convex corner, where there is
// none.
std::size_t next_ear(const Rest& rest, std::size_t start) {
  std::size_t least = start % rest.size();
  double least_turn = std::numeric_limits<double>::infinity();
  for (std::size_t step = 0; step < rest.size(); ++step) {
    const std::size_t k = (start + step) % rest.size();
    const double area = rest.turn_at(k);
    if (area == 0 || (area > 0 && rest.is_ear(k))) return k;
    if (area > 0 && area < least_turn) {
      least_turn = area;
      least = k;
    }
  }
  return least;
}

}  // namespace

std::vector<std::array<std::size_t, 3>> triangles_of(const Outline& outline) {
  std::vector<std::array<std::size_t, 3>> triangles;
  if (outline.size() < 3) return triangles;
  for (const Eigen::Vector2d& v : outline) {
    if (!v.allFinite()) return triangles;
  }
  Rest rest(outline, twice_area(outline) < 0);
  std::size_t k = 0;
  while (rest.size() >= 3) {
    k = next_ear(rest, k);
    if (rest.turn_at(k) > 0) triangles.push_back(rest.corner(k));
    rest.clip(k);
    ++k;  // not the same corner again: no fan of slivers
  }
  return triangles;
}

}  // namespace lamina
