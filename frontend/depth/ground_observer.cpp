// Pixels against the floor's disparity, onto cells.
#include <lamina/frontend/depth/ground_observer.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

constexpr int kBlock = 8;
constexpr float kSigmas = 3;
// What reaches higher is no low obstacle; `obstacle_points_body` and planes tell of it (m).
constexpr float kBand = 0.12F;
// Flatter planes are tops of things (rad).
constexpr double kLevel = 0.7;
// A cell is marked where at least so many squares of 2 x 2, and so large a share of its pixels, say
// so; it is floor where the share of the others is below the second.
constexpr float kSquares = 2, kMarkShare = 0.15F, kFloorShare = 0.05F, kFloorPixels = 8;

// Are 8 x 2 pixels within `most` px of the floor? f at the upper left one, slopes a, b.
bool all_floor(const float* upper, const float* lower, float f, float a, float b, float most) {
  int off = 0;
  for (int k = 0; k < kBlock; ++k) {
    const float at = f + a * static_cast<float>(k);
    off += std::abs(upper[k] - at) > most;
    off += std::abs(lower[k] - at - b) > most;
  }
  return off == 0;
}

}  // namespace

class GroundObserver::Walk {
 public:
  Walk(const PlaneExtractor& extractor, const FloorResult& result, const FloorOptions& options,
       std::span<const int> reference, const LocalFloor& local, std::vector<Count>& counts)
      : image_(extractor.image()),
        blocks_(extractor.blocks()),
        result_(result),
        reference_(reference),
        local_(local),
        counts_(counts),
        R_(result.T_body_camera.so3().matrix().cast<float>()),
        t_(result.T_body_camera.translation().cast<float>()),
        origin_(result.surface.origin().cast<float>()),
        nx_(result.surface.nx()),
        ny_(result.surface.ny()),
        cell_(static_cast<float>(options.cell_m)),
        least_(static_cast<float>(options.min_obstacle_height_m)) {
    const DisparityGeometry& g = extractor.geometry();
    const ExtractedPlane& floor = result.planes[static_cast<std::size_t>(result.dominant)];
    plane_ = floor.disparity.cast<float>();
    camera_height_ = static_cast<float>(std::abs(floor.plane_camera.rho()));
    fb_ = static_cast<float>(g.focal_baseline);
    cx_ = static_cast<float>(g.cx);
    cy_ = static_cast<float>(g.cy);
    inverse_fx_ = static_cast<float>(1 / g.fx);
    inverse_fy_ = static_cast<float>(1 / g.fy);
    // On the plane, cells are linear in (u, v, 1) over its disparity.
    cells_.col(0) = R_.topLeftCorner<2, 1>() * inverse_fx_;
    cells_.col(1) = R_.block<2, 1>(0, 1) * inverse_fy_;
    cells_.col(2) = R_.topRightCorner<2, 1>() - cells_.col(0) * cx_ - cells_.col(1) * cy_;
    cells_ *= fb_ / cell_;
    cell_of_camera_ = (t_.head<2>() - origin_) / cell_;
    set_noise(extractor.noise());
    // The region of interest ends before this, for what is up to kBand high.
    const double reach = 1.25 * std::hypot(options.roi_m[0], 0.5 * options.roi_m[1]);
    least_d_ = static_cast<float>(g.focal_baseline / reach);
  }

  void run() {
    for (int v = 0; v + 2 <= image_.height; v += kBlock) {
      for (int u = 0; u + kBlock <= image_.width; u += kBlock) {
        const bool floor = block_is_floor(u, v);
        for (int w = v; w < std::min(v + kBlock, image_.height - 1); w += 2) add_patch(u, w, floor);
      }
    }
  }

 private:
  void set_noise(const BlockNoise& noise) {
    const double jitter = static_cast<double>(jitter_variance(plane_.x(), plane_.y()));
    // Neighbours are alike: the mean of four pixels is hardly better than one.
    const double square = std::min(noise.pixel, noise.per_pixel / 4) + noise.local + jitter;
    sigma_ = static_cast<float>(std::sqrt(square));
    block_ = static_cast<float>(1.6 * (noise.pixel + noise.local + jitter));
    patch_ = kSigmas * static_cast<float>(std::sqrt(noise.pixel + noise.local + jitter));
  }
  float floor_at(float u, float v) const {
    return plane_.x() * (u - cx_) + plane_.y() * (v - cy_) + plane_.z();
  }
  Eigen::Vector3f point(float u, float v, float d) const {
    const float z = fb_ / d;
    return R_ * Eigen::Vector3f((u - cx_) * inverse_fx_ * z, (v - cy_) * inverse_fy_ * z, z) + t_;
  }
  int cell_of(const Eigen::Vector3f& p) const {
    const float i = (p.x() - origin_.x()) / cell_, j = (p.y() - origin_.y()) / cell_;
    if (!(i >= 0 && j >= 0 && i < static_cast<float>(nx_) && j < static_cast<float>(ny_)))
      return -1;
    return static_cast<int>(i) * ny_ + static_cast<int>(j);
  }
  // A whole block at once, where it is one: quicker, and two squares beyond their bound show.
  bool block_is_floor(int u, int v) const {
    if (blocks_.size != kBlock) return false;
    const Block& block = blocks_.at(u / kBlock, v / kBlock);
    if (block.n < kBlock * kBlock) return false;
    return block.mean_square(plane_, block.residual(plane_)) <= block_;
  }

  // 8 x 2 pixels.
  void add_patch(int u, int v, bool floor) {
    const float f = floor_at(static_cast<float>(u), static_cast<float>(v));
    if (f < least_d_) return;
    if (floor ||
        all_floor(image_.row(v) + u, image_.row(v + 1) + u, f, plane_.x(), plane_.y(), patch_)) {
      add_floor(static_cast<float>(u) + 3.5F, static_cast<float>(v) + 0.5F,
                f + 3.5F * plane_.x() + 0.5F * plane_.y(), 2 * kBlock);
    } else {
      for (int k = 0; k < kBlock; k += 2) add_square(u + k, v);
    }
  }

  // Where the line of sight meets the floor, whose disparity there is d.
  void add_floor(float u, float v, float d, float pixels) {
    const float z = 1 / d;
    const Eigen::Vector2f c =
        (cells_.col(0) * u + cells_.col(1) * v + cells_.col(2)) * z + cell_of_camera_;
    if (!(c.x() >= 0 && c.y() >= 0 && c.x() < static_cast<float>(nx_) &&
          c.y() < static_cast<float>(ny_)))
      return;
    counts_[static_cast<std::size_t>(static_cast<int>(c.x()) * ny_ + static_cast<int>(c.y()))]
        .floor += pixels;
  }

  void add_square(int u, int v) {
    const float *a = image_.row(v) + u, *b = image_.row(v + 1) + u;
    const float low = std::min(std::min(a[0], a[1]), std::min(b[0], b[1]));
    const float high = std::max(std::max(a[0], a[1]), std::max(b[0], b[1]));
    if (!(low > 0)) return;
    const float um = static_cast<float>(u) + 0.5F, vm = static_cast<float>(v) + 0.5F;
    const float f = floor_at(um, vm), d = 0.25F * (a[0] + a[1] + b[0] + b[1]);
    if (f < least_d_) return;
    const float off = d - f;
    if (std::abs(off) <= kSigmas * sigma_) return add_floor(um, vm, f, 4);
    // Astride two surfaces it lies on neither.
    if (high - low > 4 * sigma_ + 2 * std::abs(plane_.x()) + 2 * std::abs(plane_.y())) return;
    const float height = camera_height_ * off / d, sigma = camera_height_ * f / (d * d) * sigma_;
    if (off < 0) return add_sunk(point(um, vm, f), height, sigma);
    const float shown = rows_up(u, v, d);
    const float to_edge = shown > 0 ? camera_height_ * shown * plane_.y() / d : 0;
    add_raised(u, v, point(um, vm, d), {height, height + to_edge, sigma});
  }

  // Rows from the middle of a square to the upper edge of what it is on, where that ends before the
  // next square: halfway between the last pixel on it and the first beyond. 0 where it goes on.
  float rows_up(int u, int v, float d) const {
    const auto on = [&](int row) {
      if (row < 0) return true;
      const float* p = image_.row(row) + u;
      const float off = 0.5F * (p[0] + p[1]) - d;
      return p[0] > 0 && p[1] > 0 && std::abs(off) <= kSigmas * sigma_ + 2 * std::abs(plane_.y());
    };
    return !on(v - 1) ? 1.0F : !on(v - 2) ? 2.0F : 0.0F;
  }

  // Of a plane that is no low thing, or a floor of its own?
  bool other_thing(int u, int v, const Eigen::Vector3f& p) {
    const int k = result_.plane_at(u, v, image_.width);
    if (k < 0) return false;
    const int reference = reference_[static_cast<std::size_t>(k)];
    if (reference == k && k != result_.dominant) {  // another level or a ramp
      const int cell = cell_of(p);
      if (cell >= 0) counts_[static_cast<std::size_t>(cell)].floor += 4;
      return true;
    }
    const ExtractedPlane& plane = result_.planes[static_cast<std::size_t>(k)];
    return reference < 0 && plane.slope > kLevel && plane.height > 0.5 * static_cast<double>(kBand);
  }

  struct Raised {
    float height, edge, sigma;  // m above the floor: the square, the thing's edge where it shows
  };
  void add_raised(int u, int v, const Eigen::Vector3f& p, const Raised& seen) {
    const auto [height, edge, sigma] = seen;
    if (height > kBand || other_thing(u, v, p)) return;
    // Too far to tell which cell it is in.
    const float range_sigma = sigma * p.head<2>().norm() / camera_height_;
    const int cell = cell_of(p);
    if (cell < 0 || range_sigma > cell_) return;
    Count& count = counts_[static_cast<std::size_t>(cell)];
    const float above = height - local_.at(cell / ny_, cell % ny_);
    if (above < least_ + kSigmas * sigma) {
      if (above <= kSigmas * sigma) count.floor += 4;
      return;
    }
    count.up.add(p, above + edge - height, sigma);
  }

  void add_sunk(const Eigen::Vector3f& p, float height, float sigma) {
    const int cell = cell_of(p);
    if (cell < 0) return;
    Count& count = counts_[static_cast<std::size_t>(cell)];
    const float below = local_.at(cell / ny_, cell % ny_) - height;
    if (below < least_ + kSigmas * sigma) {
      if (below <= kSigmas * sigma) count.floor += 4;
      return;
    }
    count.down.add(p, below, sigma);
  }

  const DisparityImage& image_;
  const BlockImage& blocks_;
  const FloorResult& result_;
  std::span<const int> reference_;
  const LocalFloor& local_;
  std::vector<Count>& counts_;
  Eigen::Matrix3f R_;
  Eigen::Vector3f t_;
  Eigen::Vector2f origin_;
  int nx_, ny_;
  float cell_, least_;
  Eigen::Vector3f plane_;  // disparity of the floor
  float camera_height_ = 1, fb_ = 1, cx_ = 0, cy_ = 0, inverse_fx_ = 1, inverse_fy_ = 1;
  Eigen::Matrix<float, 2, 3> cells_;
  Eigen::Vector2f cell_of_camera_;
  float sigma_ = 0, patch_ = 0;  // px, of a square's mean; bound of a patch's pixels
  float block_ = 0;              // px^2, bound of a block's mean square
  float least_d_ = 0;            // px
};

void GroundObserver::Side::add(const Eigen::Vector3f& p, float from_floor, float sigma_of_it) {
  ++squares;
  x += p.x();
  y += p.y();
  if (from_floor - sigma_of_it <= proven) return;
  proven = from_floor - sigma_of_it;
  sigma = sigma_of_it;
}

GroundLook GroundObserver::look(const PlaneExtractor& extractor, const FloorResult& result,
                                std::span<const int> reference, const LocalFloor& local_floor) {
  GroundLook look;
  const int nx = result.surface.nx(), ny = result.surface.ny();
  if (result.dominant < 0 || nx == 0) return look;
  counts_.assign(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny), Count());
  Walk(extractor, result, options_, reference, local_floor, counts_).run();
  look.origin = result.surface.origin().cast<float>();
  look.cell_m = static_cast<float>(options_.cell_m);
  look.nx = nx;
  look.ny = ny;
  look.floor_bits.assign((counts_.size() + 7) / 8, 0);
  for (int i = 0; i < nx; ++i) {
    for (int j = 0; j < ny; ++j) {
      const Count& count = counts_[static_cast<std::size_t>(i * ny + j)];
      const float all = count.floor + 4 * (count.up.squares + count.down.squares);
      const bool raised = count.up.squares >= count.down.squares;
      const Side& side = raised ? count.up : count.down;
      if (side.squares >= kSquares && 4 * side.squares >= kMarkShare * all) {
        const float height = raised ? side.proven : -side.proven;
        look.marks.push_back({Eigen::Vector2f(side.x, side.y) / side.squares, height, side.sigma});
      } else if (count.floor >= kFloorPixels && all - count.floor <= kFloorShare * all) {
        look.set_floor(i, j);
      }
    }
  }
  return look;
}

}  // namespace lamina
