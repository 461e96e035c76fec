// Which regions are parts of one plane.
#include <algorithm>
#include <cmath>
#include <numeric>

#include <lamina/frontend/depth/plane_regions.hpp>

namespace lamina {
namespace {

constexpr double kNever = 1e300;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// As std::lround, which is a call here.
int nearest(double x) { return static_cast<int>(x < 0 ? x - 0.5 : x + 0.5); }

// What joining regions costs, the lower index first, and the first of the cheapest pairs of every
// row.
class PairCosts {
 public:
  struct Pair {
    std::size_t first, second;
    double cost;
    bool exact;  // not only the least that it can be
  };
  explicit PairCosts(std::size_t count)
      : count_(count), cost_(count * count, kNever), exact_(count * count, 0), cheapest_(count) {}
  void set(std::size_t i, std::size_t j, double cost, bool exact) {
    cost_[i * count_ + j] = cost;
    exact_[i * count_ + j] = exact ? 1 : 0;
  }
  void find_cheapest(std::size_t i) {
    const auto row = cost_.begin() + static_cast<std::ptrdiff_t>(i * count_);
    cheapest_[i] = static_cast<std::size_t>(
        std::min_element(row, row + static_cast<std::ptrdiff_t>(count_)) - cost_.begin());
  }
  std::optional<Pair> cheapest() const {
    const auto best =
        std::min_element(cheapest_.begin(), cheapest_.end(),
                         [&](std::size_t a, std::size_t b) { return cost_[a] < cost_[b]; });
    if (best == cheapest_.end()) return std::nullopt;
    return Pair{*best / count_, *best % count_, cost_[*best], exact_[*best] != 0};
  }
  void remove(std::size_t i) {
    for (std::size_t k = 0; k < count_; ++k) {
      cost_[i * count_ + k] = cost_[k * count_ + i] = kNever;
    }
  }
  // After `second` was joined to `first`: of a row only its places under these have changed.
  void update_cheapest(std::size_t k, std::size_t first, std::size_t second) {
    const std::size_t column = cheapest_[k] % count_, changed = k * count_ + first;
    if (k == first || k == second || column == first || column == second) {
      find_cheapest(k);
    } else if (cost_[changed] < cost_[cheapest_[k]] ||
               (cost_[changed] == cost_[cheapest_[k]] && first < column)) {
      cheapest_[k] = changed;
    }
  }

 private:
  std::size_t count_;
  std::vector<double> cost_;
  std::vector<std::uint8_t> exact_;
  std::vector<std::size_t> cheapest_;
};

// The neighbours of `second` are those of `first`, too: `near` is a matrix, row-major.
void join_neighbours(std::size_t first, std::size_t second, std::size_t count,
                     std::vector<std::uint8_t>& near) {
  for (std::size_t k = 0; k < count; ++k) {
    near[first * count + k] |= near[second * count + k];
    near[k * count + first] |= near[k * count + second];
  }
}

}  // namespace

PlaneRegions::Shape PlaneRegions::shape_of(const PlaneRegion& region) const {
  constexpr double kLevel = 0.94;  // cosine: within 20 degrees
  const DisparitySums& s = region.sums;
  Shape shape;
  shape.u = s.u / s.n;
  shape.v = s.v / s.n;
  shape.uu = s.uu / s.n - shape.u * shape.u;
  shape.uv = s.uv / s.n - shape.u * shape.v;
  shape.vv = s.vv / s.n - shape.v * shape.v;
  const auto plane = geometry_.plane(region.plane);
  shape.level = plane && plane->normal().dot(up_camera_) > kLevel;
  shape.covariance = s.covariance(noise_.per_pixel);
  return shape;
}

double PlaneRegions::Shape::distance_in_sizes2(double to_u, double to_v) const {
  const double du = to_u - u, dv = to_v - v, length2 = du * du + dv * dv;
  if (length2 < 1e-9) return 0;
  const double spread2 = (du * du * uu + 2 * du * dv * uv + dv * dv * vv) / length2;
  return length2 / std::max(1.0, spread2);
}

// A plane tells of places up to fourteen of its own sizes away (the standard deviation of its
// pixels that way: some four of its lengths). Two narrow strips at either end of an image say
// nothing of each other: there always is some plane through both.
bool PlaneRegions::within_reach(std::size_t a, std::size_t b) const {
  constexpr double kSizes = 14;
  const Shape &one = shapes_[a], &two = shapes_[b];
  return one.distance_in_sizes2(two.u, two.v) <= kSizes * kSizes ||
         two.distance_in_sizes2(one.u, one.v) <= kSizes * kSizes;
}

double PlaneRegions::joined_cost(const PlaneRegion& a, const PlaneRegion& b) const {
  DisparitySums both = a.sums;
  both += b.sums;
  const auto fit = both.fit();
  if (!fit) return kNever;
  double worst = 0;
  for (const PlaneRegion* r : {&a, &b}) {
    // Three parameters of its own: their noise is 3 / n of a pixel's.
    const double allowed = gate2_ * (3 * noise_.per_pixel / r->sums.n + noise_.shared);
    worst = std::max(worst, r->sums.mean_square(r->plane - *fit) / allowed);
    if (worst > 1) break;  // too much already
  }
  return worst;
}

// What two regions apart from each other differ by, each plane carried to where the other is.
double PlaneRegions::carried_cost(std::size_t a, std::size_t b) const {
  const DisparityPlane difference = regions_[a].plane - regions_[b].plane;
  double worst = 0;
  for (const auto& [here, there] : {std::pair{a, b}, std::pair{b, a}}) {
    const Eigen::Vector3d x(shapes_[there].u, shapes_[there].v, 1);
    const double carried = x.dot(shapes_[here].covariance * x);
    const double allowed = 4 * (carried + 2 * noise_.shared);
    worst = std::max(worst, regions_[there].sums.mean_square(difference) / allowed);
    if (worst > 1) break;
  }
  return worst;
}

// What joining two regions costs at least; `apart_cost` says what it really costs where they are
// apart from each other.
double PlaneRegions::least_cost(std::size_t a, std::size_t b, bool neighbours) const {
  if (neighbours) return joined_cost(regions_[a], regions_[b]);
  if (!within_reach(a, b)) return kNever;
  const double joined = joined_cost(regions_[a], regions_[b]);
  if (joined > 1) return joined;
  return two_platforms(a, b) ? kNever : joined;
}

// Slow distortion tilts a plane; carried beyond its own size that tilt counts. Where the gap shows
// what lies behind, nothing says that the two belong together, and no such allowance is made; where
// something stands before it, they are neighbours.
double PlaneRegions::apart_cost(std::size_t a, std::size_t b, double joined) const {
  const double carried = carried_cost(a, b);
  return carried <= joined || !seen_through(a, b) ? joined : carried;
}

// Whether two regions are level, neither of them the ground, and most of the way from one to the
// other belongs to regions that lie behind both: lower ones.
bool PlaneRegions::two_platforms(std::size_t a, std::size_t b) const {
  const PlaneRegion &one = regions_[a], &two = regions_[b];
  if (std::max(one.sums.n, two.sums.n) >= most_pixels_) return false;
  if (!shapes_[a].level || !shapes_[b].level) return false;
  const Eigen::Vector2d from(shapes_[a].u, shapes_[a].v), to(shapes_[b].u, shapes_[b].v);
  const int steps = std::max(2, static_cast<int>((to - from).norm() / blocks_->size));
  int lower = 0, other = 0;
  for (int k = 0; k <= steps; ++k) {
    const Eigen::Vector2d x = from + (to - from) * k / steps;
    const int c = nearest(x.x() + geometry_.cx) / blocks_->size;
    const int r = nearest(x.y() + geometry_.cy) / blocks_->size;
    if (c < 0 || r < 0 || c >= blocks_->columns || r >= blocks_->rows) continue;
    const std::int16_t label = labels_[at(blocks_->index(c, r))];
    const std::size_t successor = label < 0 ? a : at(successors_[at(label)]);
    if (label >= 0 && (successor == a || successor == b)) continue;
    const Eigen::Vector3d place(x.x(), x.y(), 1);
    const auto behind = [&](const PlaneRegion& r_near) {
      return place.dot(regions_[successor].plane - r_near.plane) < 0;
    };
    ++(label >= 0 && behind(one) && behind(two) ? lower : other);
  }
  return lower > other;
}

// Whether the gap between two regions is open: most blocks on the way from middle to middle lie
// behind the first one's plane.
bool PlaneRegions::seen_through(std::size_t a, std::size_t b) const {
  const Eigen::Vector2d from(shapes_[a].u, shapes_[a].v), to(shapes_[b].u, shapes_[b].v);
  const Eigen::Vector3f plane = regions_[a].plane.cast<float>();
  const int steps = std::max(2, static_cast<int>((to - from).norm() / blocks_->size));
  const float gate2 = gate2_ * static_cast<float>(noise_.of_mean(64));
  int behind = 0, other = 0;
  // The rest of the way cannot turn a majority of all its places.
  for (int k = 0; k <= steps && 2 * std::max(behind, other) <= steps + 1; ++k) {
    const Eigen::Vector2d x = from + (to - from) * k / steps;
    const int c = nearest(x.x() + geometry_.cx) / blocks_->size;
    const int r = nearest(x.y() + geometry_.cy) / blocks_->size;
    if (c < 0 || r < 0 || c >= blocks_->columns || r >= blocks_->rows) continue;
    const Block& block = blocks_->at(c, r);
    const float residual = block.residual(plane);
    if (block.n > 0 && residual * residual <= gate2) continue;
    ++(block.n > 0 && residual < 0 ? behind : other);
  }
  return behind > other;
}

// Which regions come within two blocks of each other: a matrix, row-major.
std::vector<std::uint8_t> PlaneRegions::neighbourhood() const {
  const std::size_t count = regions_.size();
  std::vector<std::uint8_t> near(count * count, 0);
  const auto meet = [&](int a, int b) {
    if (a == b || a < 0 || b < 0) return;
    near[at(a) * count + at(b)] = near[at(b) * count + at(a)] = 1;
  };
  const int columns = blocks_->columns, rows = blocks_->rows;
  for (int r = 0; r < rows; ++r) {
    const std::int16_t* const row = labels_.data() + blocks_->index(0, r);
    for (int step = 1; step <= 2; ++step) {
      for (int c = 0; c + step < columns; ++c) meet(row[c], row[c + step]);
      if (r + step >= rows) continue;
      for (int c = 0; c < columns; ++c) meet(row[c], row[c + step * columns]);
    }
  }
  return near;
}

void PlaneRegions::start_merging(const Eigen::Vector3d& up_camera) {
  up_camera_ = up_camera;
  successors_.resize(regions_.size());
  std::iota(successors_.begin(), successors_.end(), std::int16_t{0});
  most_pixels_ = 0;
  for (const PlaneRegion& r : regions_) most_pixels_ = std::max(most_pixels_, r.sums.n);
  shapes_.clear();
  for (const PlaneRegion& r : regions_) shapes_.push_back(shape_of(r));
}

// Best pairs first; costs are kept, and only those of the joined one are taken anew. Of pairs apart
// from each other the least that they can cost is known first, and the rest found out when that is
// the least of all: most of them are joined with others before.
void PlaneRegions::merge(const Eigen::Vector3d& up_camera) {
  const std::size_t count = regions_.size();
  start_merging(up_camera);
  std::vector<std::uint8_t> near = neighbourhood();
  PairCosts costs(count);
  const auto set = [&](std::size_t i, std::size_t j) {
    const bool neighbours = near[i * count + j] != 0;
    costs.set(i, j, least_cost(i, j, neighbours), neighbours);
  };
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) set(i, j);
  }
  for (std::size_t i = 0; i < count; ++i) costs.find_cheapest(i);
  bool any = false;
  for (;;) {
    const auto best = costs.cheapest();
    if (!best || best->cost > 1) break;
    const auto [first, second, least, exact] = *best;
    if (!exact) {
      const double cost = apart_cost(first, second, least);
      costs.set(first, second, cost, true);
      if (cost > least) {
        costs.find_cheapest(first);
        continue;
      }
    }
    any = true;
    join(first, second);
    std::replace(successors_.begin(), successors_.end(), static_cast<std::int16_t>(second),
                 static_cast<std::int16_t>(first));
    join_neighbours(first, second, count, near);
    costs.remove(second);
    for (std::size_t k = 0; k < count; ++k) {
      if (k != first && at(successors_[k]) == k) set(std::min(k, first), std::max(k, first));
    }
    for (std::size_t k = 0; k < count; ++k) costs.update_cheapest(k, first, second);
  }
  if (any) relabel(successors_);
}

void PlaneRegions::join(std::size_t first, std::size_t second) {
  PlaneRegion& a = regions_[first];
  a.sums += regions_[second].sums;
  a.blocks += regions_[second].blocks;
  a.pixels += regions_[second].pixels;
  a.plane = a.sums.fit().value_or(a.plane);
  most_pixels_ = std::max(most_pixels_, a.sums.n);
  shapes_[first] = shape_of(a);
  regions_[second] = PlaneRegion();
}

}  // namespace lamina
