// Patches of pixels onto ground cells.
#include <lamina/frontend/depth/ground_cells.hpp>

#include <algorithm>
#include <cmath>
#include <span>

namespace lamina {
namespace {

constexpr int kPatchU = 8, kPatchV = 2;
constexpr float kPatchPixels = kPatchU * kPatchV;
// Patches further than this from their floor are not floor; the test of low obstacles ends here.
constexpr float kBand = 0.1F;
// Planes flatter than this (rad) are tops of things; rims are looked for above this height (m).
constexpr double kLevel = 0.7;
constexpr float kRim = 0.05F;
// From here on a large plane is another level or a ramp (rad, m).
constexpr double kOwnSlope = 0.026, kOwnHeight = 0.04;

struct PatchMean {
  float d = 0;
  bool good = false;
};

// Mean disparity of a patch; not good when a pixel is missing or it holds two surfaces.
PatchMean mean_of(const float* upper, const float* lower, float limit) {
  float sum[kPatchU], square[kPatchU], least[kPatchU];
  const float shift = upper[kPatchU / 2];
  for (int k = 0; k < kPatchU; ++k) {
    const float a = upper[k] - shift, b = lower[k] - shift;
    sum[k] = a + b;
    square[k] = a * a + b * b;
    least[k] = std::min(upper[k], lower[k]);
  }
  float s = 0, q = 0, m = least[0];
  for (int k = 0; k < kPatchU; ++k) {
    s += sum[k];
    q += square[k];
    m = std::min(m, least[k]);
  }
  if (!(m > 0)) return {};
  const float mean = s / kPatchPixels;
  return {shift + mean, q / kPatchPixels - mean * mean <= limit};
}

}  // namespace

// What a walk over the patches needs beside the pixels; rays are (x / z, y / z, 1).
class PatchWalk {
 public:
  PatchWalk(const PlaneExtractor& extractor, const FloorResult& result, const FloorOptions& options,
            std::span<const int> reference, std::vector<GroundSums>& sums)
      : image_(extractor.image()),
        result_(result),
        reference_(reference),
        sums_(sums),
        R_(result.T_body_camera.so3().matrix().cast<float>()),
        t_(result.T_body_camera.translation().cast<float>()),
        origin_(result.surface.origin().cast<float>()),
        nx_(result.surface.nx()),
        ny_(result.surface.ny()),
        inverse_cell_(static_cast<float>(1 / options.cell_m)),
        ceiling_(static_cast<float>(options.roi_m[2])),
        cellar_(-static_cast<float>(options.roi_depth_below_m)) {
    const DisparityGeometry& g = extractor.geometry();
    fb_ = static_cast<float>(g.focal_baseline);
    cx_ = static_cast<float>(g.cx);
    cy_ = static_cast<float>(g.cy);
    inverse_fx_ = static_cast<float>(1 / g.fx);
    inverse_fy_ = static_cast<float>(1 / g.fy);
    // Across a patch a floor's disparity changes by its slope; 9 sigma^2 leaves room for it.
    limit_ = static_cast<float>(9 * extractor.noise().pixel) + 0.02F;
    per_px_ =
        static_cast<float>(std::sqrt(extractor.noise().of_mean(kPatchPixels)) / g.focal_baseline);
    pixel_per_px_ = static_cast<float>(std::sqrt(extractor.noise().pixel) / g.focal_baseline);
    for (const ExtractedPlane& p : result.planes) add_plane(p, g);
  }

  void run() {
    for (int v = 0; v + kPatchV <= image_.height; v += kPatchV) {
      for (int u = 0; u + kPatchU <= image_.width; u += kPatchU) add_patch(u, v);
    }
  }

 private:
  struct PlaneInfo {
    Eigen::Vector4f reference{0, 0, 1, 0};  ///< body frame: height above it counts
    Eigen::Vector3f inverse_depth{0, 0, 0};
    bool level = false;  ///< flat enough to be a top
  };

  void add_plane(const ExtractedPlane& p, const DisparityGeometry& g) {
    PlaneInfo info;
    const int reference = reference_[planes_.size() - 1];
    if (reference >= 0) {
      const Plane& floor = result_.planes[static_cast<std::size_t>(reference)].plane_body;
      info.reference = floor.homogeneous().cast<float>();
    }
    const Eigen::Vector3d d = p.disparity / g.focal_baseline;  // 1/Z, of rays (x, y, 1)
    info.inverse_depth = Eigen::Vector3d(d.x() * g.fx, d.y() * g.fy, d.z()).cast<float>();
    info.level = p.slope <= kLevel;
    planes_.push_back(info);
  }

  std::size_t mark(int u, int v) const {
    return result_
        .pixel_labels[static_cast<std::size_t>(v) * static_cast<std::size_t>(image_.width) +
                      static_cast<std::size_t>(u)];
  }
  Eigen::Vector3f ray(float u, float v) const {
    return {(u - cx_) * inverse_fx_, (v - cy_) * inverse_fy_, 1};
  }
  // Of a point inside the region of interest; nullptr outside.
  GroundSums* cell_of(const Eigen::Vector3f& p) const {
    const float i = (p.x() - origin_.x()) * inverse_cell_,
                j = (p.y() - origin_.y()) * inverse_cell_;
    if (!(i >= 0 && j >= 0 && i < static_cast<float>(nx_) && j < static_cast<float>(ny_)))
      return nullptr;
    if (p.z() > ceiling_ || p.z() < cellar_) return nullptr;
    return &sums_[static_cast<std::size_t>(static_cast<int>(i) * ny_ + static_cast<int>(j))];
  }

  void add_patch(int u, int v) {
    const float* upper = image_.row(v) + u;
    if (!(upper[kPatchU / 2] > 0)) return;
    const PatchMean mean = mean_of(upper, image_.row(v + 1) + u, limit_);
    if (!mean.good) return add_edge(u, v, kPatchV);
    const Eigen::Vector3f r = ray(static_cast<float>(u) + 3.5F, static_cast<float>(v) + 0.5F);
    const std::size_t m = mark(u + kPatchU / 2, v);
    const float z = depth_of(mean.d, m, r);
    const Eigen::Vector3f p = R_ * (z * r) + t_;
    GroundSums* cell = cell_of(p);
    if (cell == nullptr) return;
    const float residual = planes_[m].reference.head<3>().dot(p) + planes_[m].reference.w();
    cell->top = std::max(cell->top, top_of(p.z(), m, r, z));
    if (std::abs(residual) > kBand) {
      cell->above += kPatchPixels;
      if (!planes_[m].level) add_edge(u, v, 1);
      return;
    }
    cell->pixels += kPatchPixels;
    cell->z += p.z() * kPatchPixels;
    cell->residual += residual * kPatchPixels;
    cell->depth += z * kPatchPixels;
    if (m > 0 && reference_[m - 1] >= 0) {
      cell->floor_pixels += kPatchPixels;
      cell->floor_z += p.z() * kPatchPixels;
      cell->plane = static_cast<std::int16_t>(m - 1);
    }
  }

  // A patch of what stands upright lies where its plane does: by its own depth the noise of ranges
  // strews a wall over the floor before it.
  float depth_of(float d, std::size_t m, const Eigen::Vector3f& r) const {
    const float inverse = m > 0 && !planes_[m].level ? planes_[m].inverse_depth.dot(r) : 0;
    return inverse > 1e-3F ? 1 / inverse : fb_ / d;
  }

  // Rims of things that stand: each pixel by the plane it belongs to, which knows its depth better
  // than the pixel does; where there is none by itself, if the pixel below it agrees.
  void add_edge(int u0, int v0, int rows) {
    for (int v = v0; v < v0 + rows; ++v) {
      for (int u = u0; u < u0 + kPatchU; ++u) {
        const std::size_t m = mark(u, v);
        if (m > 0 ? static_cast<int>(m) - 1 == result_.dominant : !(image_.row(v)[u] > 0)) continue;
        const Eigen::Vector3f r = ray(static_cast<float>(u), static_cast<float>(v));
        const float inverse = m > 0 ? planes_[m].inverse_depth.dot(r) : own_inverse(u, v);
        if (!(inverse > 1e-3F)) continue;
        const float z = 1 / inverse, fall = R_.row(2).dot(r), height = z * fall + t_.z();
        if (height < kRim || height > ceiling_) continue;
        const float check_match = m > 0 ? 0 : pixel_per_px_ * z * z * std::abs(fall);
        const Eigen::Vector3f p = R_ * (z * r) + t_;
        if (GroundSums* cell = cell_of(p)) {
          cell->top = std::max(cell->top, p.z() - check_match);
          if (rows > 1 && p.z() > kBand) cell->above += 1;
        }
      }
    }
  }

  // 1/Z of a pixel that is no stray: the one below it (above it in the last row) says the same.
  float own_inverse(int u, int v) const {
    const float d = image_.row(v)[u];
    const float other = image_.row(v + 1 < image_.height ? v + 1 : v - 1)[u];
    if (!(d > 0 && other > 0) || (d - other) * (d - other) > limit_) return 0;
    return d / fb_;
  }

  // Height a patch proves: that of its plane where it has a level one, else its own less a sigma,
  // because the highest of several noisy patches is too high.
  float top_of(float height, std::size_t m, const Eigen::Vector3f& r, float z) const {
    const float fall = R_.row(2).dot(r);
    if (planes_[m].level) {
      const float inverse = planes_[m].inverse_depth.dot(r);
      if (inverse > 1e-3F) return fall / inverse + t_.z();
    }
    return height - per_px_ * z * z * std::abs(fall);
  }

  const DisparityImage& image_;
  const FloorResult& result_;
  std::span<const int> reference_;
  std::vector<GroundSums>& sums_;
  std::vector<PlaneInfo> planes_{PlaneInfo()};  ///< by mark; 0: no plane
  Eigen::Matrix3f R_;
  Eigen::Vector3f t_;
  Eigen::Vector2f origin_;
  int nx_, ny_;
  float inverse_cell_, ceiling_, cellar_;
  float fb_ = 1, cx_ = 0, cy_ = 0, inverse_fx_ = 1, inverse_fy_ = 1, limit_ = 0;
  /// m of height a patch's mean, and one pixel, are unsure by, per m^2 of depth times fall.
  float per_px_ = 0, pixel_per_px_ = 0;
};

// Large level planes and ramps are floors of their own; all else is compared with the dominant.
void GroundMapper::choose_references(const FloorResult& result) {
  reference_.assign(result.planes.size(), -1);
  surface_plane_.assign(result.planes.size(), -1);
  for (std::size_t k = 0; k < result.planes.size(); ++k) {
    const ExtractedPlane& plane = result.planes[k];
    const bool dominant = static_cast<int>(k) == result.dominant;
    if (!dominant && plane.kind != PlaneKind::kSubDominant) continue;
    // A region that hugs the floor may be floor and plates mixed: it must not hide the plates.
    const bool distinct = plane.slope > kOwnSlope || std::abs(plane.height) > kOwnHeight;
    const bool large = plane.area >= options_.min_level_area_m2;
    reference_[k] = dominant || (large && distinct) ? static_cast<int>(k) : result.dominant;
  }
}

void GroundMapper::fill_surface(const PlaneExtractor& extractor, FloorResult& result) {
  const double fb = extractor.geometry().focal_baseline;
  for (std::size_t k = 0; k < result.planes.size(); ++k) {
    if (reference_[k] < 0) continue;
    const Plane& p = result.planes[k].plane_body;
    const Eigen::Vector3d& n = p.normal();
    surface_plane_[k] = static_cast<int>(result.surface.planes().size());
    result.surface.add_plane({-n.x() / n.z(), -n.y() / n.z(), p.rho() / n.z()});
  }
  const double h =
      std::abs(result.planes[static_cast<std::size_t>(result.dominant)].plane_camera.rho());
  for (int i = 0; i < nx_; ++i) {
    for (int j = 0; j < ny_; ++j) {
      const GroundSums& s = sums_[static_cast<std::size_t>(i * ny_ + j)];
      GroundCell& cell = result.surface.at(i, j);
      if (s.top > -1e8F) cell.top = s.top;
      cell.pixels = static_cast<std::int32_t>(s.pixels + s.above);
      if (s.pixels <= 0) continue;
      cell.height = s.floor_pixels > 0 ? s.floor_z / s.floor_pixels : s.z / s.pixels;
      const double depth = static_cast<double>(s.depth / s.pixels);
      cell.sigma = static_cast<float>(
          h * depth / fb * std::sqrt(extractor.noise().of_mean(static_cast<double>(s.pixels))));
      if (s.plane >= 0) {
        cell.plane = static_cast<std::int16_t>(surface_plane_[static_cast<std::size_t>(s.plane)]);
      }
    }
  }
}

void GroundMapper::fill_evidence(const PlaneExtractor& extractor, const FloorResult& result) {
  evidence_.origin = result.surface.origin();
  evidence_.cell_m = options_.cell_m;
  evidence_.nx = nx_;
  evidence_.ny = ny_;
  evidence_.cells.assign(sums_.size(), CellEvidence());
  const double h =
      std::abs(result.planes[static_cast<std::size_t>(result.dominant)].plane_camera.rho());
  const double fb = extractor.geometry().focal_baseline;
  for (std::size_t k = 0; k < sums_.size(); ++k) {
    const GroundSums& s = sums_[k];
    // A cell with as much beside the floor as on it is the foot of something.
    if (s.pixels < kPatchPixels || s.above > s.pixels) continue;
    CellEvidence& cell = evidence_.cells[k];
    cell.range = s.depth / s.pixels;
    const double per_px = h * static_cast<double>(cell.range) / fb;  // m of height per px
    cell.height = s.residual / s.pixels;
    cell.information = static_cast<float>(static_cast<double>(s.pixels) /
                                          (extractor.noise().per_pixel * per_px * per_px));
    cell.shared_variance = static_cast<float>(extractor.noise().local * per_px * per_px);
  }
}

void GroundMapper::map(const PlaneExtractor& extractor, FloorResult& result) {
  evidence_ = EvidenceGrid();
  if (result.dominant < 0) return;
  nx_ = static_cast<int>(std::ceil(options_.roi_m[0] / options_.cell_m));
  ny_ = static_cast<int>(std::ceil(options_.roi_m[1] / options_.cell_m));
  result.surface = FloorSurface({0, -0.5 * options_.roi_m[1]}, options_.cell_m, nx_, ny_);
  sums_.assign(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_), GroundSums());
  choose_references(result);
  PatchWalk(extractor, result, options_, reference_, sums_).run();
  fill_surface(extractor, result);
  fill_evidence(extractor, result);
  std::vector<float> residuals;
  LocalFloor local_floor;
  result.low_obstacles = find_low_obstacles(evidence_, options_, &residuals, &local_floor);
  result.look = observer_.look(extractor, result, reference_, local_floor);
  for (int i = 0; i < nx_; ++i) {
    for (int j = 0; j < ny_; ++j) {
      const std::size_t k = static_cast<std::size_t>(i * ny_ + j);
      GroundCell& cell = result.surface.at(i, j);
      cell.residual = residuals[k];
      cell.information = evidence_.cells[k].information;
      cell.shared_variance = evidence_.cells[k].shared_variance;
      const bool stands_above = sums_[k].above > 0 && sums_[k].top > kBand;
      if (!stands_above) continue;
      const Eigen::Vector2d c = result.surface.center(i, j);
      result.obstacle_points_body.emplace_back(c.x(), c.y(), static_cast<double>(cell.top));
    }
  }
}

}  // namespace lamina
