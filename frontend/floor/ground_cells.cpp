// Patches of pixels onto ground cells.
#include <lamina/frontend/floor/ground_cells.hpp>

#include <cmath>

namespace lamina {
namespace {

constexpr int kPatchU = 8, kPatchV = 2;
constexpr float kPatchPixels = kPatchU * kPatchV;
// Patches further than this from their floor are not floor; the test of low obstacles ends here.
constexpr float kBand = 0.1F;
// From here on a large plane is another level or a ramp (rad, m).
constexpr double kOwnSlope = 0.026, kOwnHeight = 0.04;

struct Rigid {
  Eigen::Matrix3f R;
  Eigen::Vector3f t;
};

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

// Height a patch proves: that of its plane where it has a level one, else its own less a sigma,
// because the highest of several noisy patches is too high.
float top_of(float height, std::size_t mark, float rx, float ry, float z, const Rigid& T,
             const std::vector<Eigen::Vector3f>& inverse_depth, float per_px) {
  const Eigen::Vector3f ray(rx, ry, 1);
  const float fall = T.R.row(2).dot(ray);
  if (mark > 0) {
    const float inverse = inverse_depth[mark].dot(ray);
    if (inverse > 1e-3F) return fall / inverse + T.t.z();
  }
  return height - per_px * z * z * std::abs(fall);
}

}  // namespace

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

void GroundMapper::add_patches(const PlaneExtractor& extractor, const FloorResult& result) {
  const DisparityImage& image = extractor.image();
  const DisparityGeometry& g = extractor.geometry();
  const Rigid T{result.T_body_camera.so3().matrix().cast<float>(),
                result.T_body_camera.translation().cast<float>()};
  const float fb = static_cast<float>(g.focal_baseline), inverse_fx = static_cast<float>(1 / g.fx);
  const float inverse_fy = static_cast<float>(1 / g.fy);
  // Across a patch a floor's disparity changes by its slope; 9 sigma^2 leaves room for it.
  const float limit = static_cast<float>(9 * extractor.noise().pixel) + 0.02F;
  const float x0 = static_cast<float>(result.surface.origin().x());
  const float y0 = static_cast<float>(result.surface.origin().y());
  const float inverse_cell = static_cast<float>(1 / options_.cell_m);
  const float ceiling = static_cast<float>(options_.roi_m[2]);
  const float cellar = -static_cast<float>(options_.roi_depth_below_m);
  std::vector<Eigen::Vector4f> reference(result.planes.size() + 1, Eigen::Vector4f(0, 0, 1, 0));
  for (std::size_t k = 0; k < result.planes.size(); ++k) {
    if (reference_[k] < 0) continue;
    const Plane& p = result.planes[static_cast<std::size_t>(reference_[k])].plane_body;
    reference[k + 1] = p.homogeneous().cast<float>();
  }
  // Planes that lie flat enough to be tops: their own height is surer than a patch's.
  std::vector<Eigen::Vector3f> disparity_plane(result.planes.size() + 1, Eigen::Vector3f::Zero());
  for (std::size_t k = 0; k < result.planes.size(); ++k) {
    const ExtractedPlane& p = result.planes[k];
    if (p.slope > 0.7) continue;
    const Eigen::Vector3d d = p.disparity / g.focal_baseline;  // 1/Z, of rays (rx, ry, 1)
    disparity_plane[k + 1] = Eigen::Vector3d(d.x() * g.fx, d.y() * g.fy, d.z()).cast<float>();
  }
  // m of height a patch's mean is unsure by, per m^2 of depth times ray's fall.
  const float per_px =
      static_cast<float>(std::sqrt(extractor.noise().of_mean(kPatchPixels)) / g.focal_baseline);
  for (int v = 0; v + kPatchV <= image.height; v += kPatchV) {
    const float* upper = image.row(v);
    const float* lower = image.row(v + 1);
    const std::uint8_t* marks = result.pixel_labels.data() +
                                static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width);
    const float ry = static_cast<float>((v + 0.5 - g.cy)) * inverse_fy;
    for (int u = 0; u + kPatchU <= image.width; u += kPatchU) {
      if (!(upper[u + kPatchU / 2] > 0)) continue;
      const PatchMean mean = mean_of(upper + u, lower + u, limit);
      if (!(mean.d > 0)) continue;
      const float z = fb / mean.d;
      const float rx = (static_cast<float>(u - g.cx) + 3.5F) * inverse_fx;
      const Eigen::Vector3f p = T.R * Eigen::Vector3f(rx * z, ry * z, z) + T.t;
      const float i = (p.x() - x0) * inverse_cell, j = (p.y() - y0) * inverse_cell;
      if (!(i >= 0 && j >= 0 && i < static_cast<float>(nx_) && j < static_cast<float>(ny_)))
        continue;
      if (p.z() > ceiling || p.z() < cellar) continue;
      GroundSums& cell =
          sums_[static_cast<std::size_t>(static_cast<int>(i) * ny_ + static_cast<int>(j))];
      const std::size_t mark = marks[u + kPatchU / 2];
      if (!mean.good) continue;
      const float residual = reference[mark].head<3>().dot(p) + reference[mark].w();
      cell.top = std::max(cell.top, top_of(p.z(), mark, rx, ry, z, T, disparity_plane, per_px));
      if (std::abs(residual) > kBand) {
        cell.above += kPatchPixels;
        continue;
      }
      cell.pixels += kPatchPixels;
      cell.z += p.z() * kPatchPixels;
      cell.residual += residual * kPatchPixels;
      cell.depth += z * kPatchPixels;
      if (mark > 0 && reference_[mark - 1] >= 0) {
        cell.floor_pixels += kPatchPixels;
        cell.floor_z += p.z() * kPatchPixels;
        cell.plane = static_cast<std::int16_t>(mark - 1);
      }
    }
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
  add_patches(extractor, result);
  fill_surface(extractor, result);
  fill_evidence(extractor, result);
  std::vector<float> residuals;
  result.low_obstacles = find_low_obstacles(evidence_, options_, &residuals);
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
