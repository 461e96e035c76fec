// The whole chain: planes, floor, surface, surfels, outlines.
#include <lamina/frontend/depth/floor_frontend.hpp>

#include <cmath>

#include <lamina/frontend/depth/cloud_planes.hpp>
#include <lamina/frontend/depth/floor_judge.hpp>
#include <lamina/frontend/depth/ground_cells.hpp>
#include <lamina/frontend/depth/outlines.hpp>
#include <lamina/frontend/depth/plane_extractor.hpp>
#include <lamina/frontend/depth/quarter_labels.hpp>
#include <lamina/frontend/depth/surfels.hpp>
#include <lamina/models/error.hpp>
#include <lamina/models/model_archive.hpp>
#include <lamina/models/stopwatch.hpp>

namespace lamina {
namespace {

FloorOptions checked(const FloorOptions& options) {
  const auto problems = options.problems();
  if (!problems.empty()) throw Error(problems.front());
  return options;
}

// Area on each plane: a pixel at depth Z covers Z^3 / (fx fy |rho|).
std::vector<double> areas(const PlaneExtractor& extractor, std::span<const double> rho) {
  std::vector<double> result(rho.size(), 0);
  const DisparityGeometry& g = extractor.geometry();
  const auto labels = extractor.regions().labels();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] < 0) continue;
    const std::size_t k = static_cast<std::size_t>(labels[i]);
    const Block& b = extractor.blocks().blocks[i];
    const double z = g.focal_baseline / static_cast<double>(b.d);
    result[k] += static_cast<double>(b.n) * z * z * z / (g.fx * g.fy * std::abs(rho[k]));
  }
  return result;
}

// Pixels at a border show some of what is behind it: a sensor compares windows some pixels wide. An
// upright face w pixels wide along its slope (px of disparity a px) is off by a window's slope, as
// often as a window goes into w: most of what is wrong with faces seen at a grazing angle. Floors
// and what stands on them are at the same distance where they meet.
double border_error(const PlaneRegion& region) {
  constexpr double kWindow = 8;  // px
  const DisparitySums& s = region.sums;
  const Eigen::Vector2d slope = region.plane.head<2>(), mean(s.u / s.n, s.v / s.n);
  Eigen::Matrix2d spread;
  spread << s.uu, s.uv, s.uv, s.vv;
  spread = spread / s.n - mean * mean.transpose();
  const double square = std::max(slope.squaredNorm(), 1e-12);
  const double width = std::sqrt(12 * std::max(0.0, slope.dot(spread * slope)) / square);
  return std::sqrt(square) * kWindow * kWindow / std::max(kWindow, width);
}

// `shared_px`: what all pixels of the plane are off by, 1-sigma.
NoiseFloor noise_floor(const Moments& moments, const Plane& plane, const DisparityGeometry& g,
                       double shared_px) {
  NoiseFloor floor;
  const double z = moments.mean().z();
  floor.sigma_rho = std::abs(plane.rho()) * z / g.focal_baseline * shared_px;
  const Matrix32d B = plane.tangent_basis();
  const double spread2 = 0.5 * (B.transpose() * moments.scatter() * B).trace() / moments.weight();
  floor.sigma_tilt = std::min(0.1, floor.sigma_rho / std::sqrt(std::max(spread2, 1e-6)));
  floor.sigma_bend = floor.sigma_rho;
  return floor;
}

// Where a plane ends is known to where noise lets what it meets be of it: 2 sigma (of a patch whose
// noise is alike) over its slope (px of disparity a px), `most` px at most. On a floor h m below a
// pixel spans Z^2 / (f h), metres far away; by coarse stereo, the foot of a wall passes for floor
// beyond it. A corner `at` (px) further than the plane's centre is drawn in by that, to the centre
// at most, where it comes to more than kSure m: the rest is seen from nearer, or may not be there.
Eigen::Vector2d surely_on(const ExtractedPlane& plane, const DisparityGeometry& g,
                          const Eigen::Vector2d& at, double most, double variance) {
  constexpr double kSure = 0.3;  // m
  const Eigen::Vector2d slope = plane.disparity.head<2>();
  const double steep = slope.norm(), d = slope.dot(at) + plane.disparity.z();
  const double center = g.focal_baseline / std::max(0.1, plane.centroid_camera.z());
  if (!(steep > 0) || !(d > 0) || !(d < center)) return at;
  const double unsure = std::min(2 * std::sqrt(variance) / steep, most);
  const double d_in = std::min(center, d + unsure * steep);
  const Eigen::Vector2d in = at + (d_in - d) / (steep * steep) * slope;
  const double apart = (g.point(at.x(), at.y(), d) - g.point(in.x(), in.y(), d_in)).norm();
  return apart > kSure ? in : at;
}

}  // namespace

struct FloorFrontend::State {
  explicit State(const FloorOptions& o) : options(o), extractor(o), judge(o), mapper(o), cloud(o) {}

  void collect_planes(FloorResult& result);
  void mark_uncertain_borders(FloorResult& result);
  void trace(FloorResult& result);

  FloorOptions options;
  PlaneExtractor extractor;
  FloorJudge judge;
  GroundMapper mapper;
  CloudPlanes cloud;
};

void FloorFrontend::State::collect_planes(FloorResult& result) {
  const DisparityGeometry& g = extractor.geometry();
  std::vector<double> rho;
  for (const PlaneRegion& region : extractor.regions().regions()) {
    ExtractedPlane p;
    // The extractor keeps only regions whose plane and moments exist.
    p.plane_camera = g.plane(region.plane).value_or(Plane({0, 0, -1}, -1e6));
    p.disparity = region.plane;
    p.moments_camera =
        region.sums.moments(g, p.plane_camera, extractor.noise().per_pixel).value_or(Moments());
    p.centroid_camera = p.plane_camera.project(p.moments_camera.mean());
    p.floor = noise_floor(p.moments_camera, p.plane_camera, g, std::sqrt(extractor.noise().shared));
    p.pixels = region.pixels;
    p.rms_px = std::sqrt(region.sums.sse(region.plane) / std::max(1.0, region.sums.n));
    rho.push_back(p.plane_camera.rho());
    result.planes.push_back(std::move(p));
  }
  const auto area = areas(extractor, rho);
  for (std::size_t k = 0; k < area.size(); ++k) result.planes[k].area = area[k];
}

void FloorFrontend::State::mark_uncertain_borders(FloorResult& result) {
  for (std::size_t k = 0; k < result.planes.size(); ++k) {
    ExtractedPlane& p = result.planes[k];
    if (p.slope < kUprightSlope) continue;
    const double shared = std::hypot(std::sqrt(extractor.noise().shared),
                                     border_error(extractor.regions().regions()[k]));
    p.floor = noise_floor(p.moments_camera, p.plane_camera, extractor.geometry(), shared);
  }
}

void FloorFrontend::State::trace(FloorResult& result) {
  const DisparityGeometry& g = extractor.geometry();
  QuarterLabels quarters = quarter_labels(extractor.image(), extractor.blocks(),
                                          result.blocks.plane, result.pixel_labels);
  prune_thin_borders(quarters);
  drop_coarse(quarters, result.planes, g);
  const auto outlines = trace_outlines(quarters.labels, quarters.columns, quarters.rows,
                                       static_cast<int>(result.planes.size()), 0.75);
  const auto px = [&](double corner, int most) {
    return std::min(quarters.first_px(static_cast<int>(corner)), most) - 0.5;
  };
  const double variance = extractor.noise().per_pixel;
  for (std::size_t k = 0; k < outlines.size(); ++k) {
    ExtractedPlane& plane = result.planes[k];
    // A corner may lie beyond the last pixel: not beyond twice the depth of the plane's centre.
    const double least = 0.25 * g.focal_baseline / std::max(0.1, plane.centroid_camera.z());
    for (const Eigen::Vector2d& corner : outlines[k]) {
      const double u = px(corner.x(), extractor.image().width) - g.cx;
      const double v = px(corner.y(), extractor.image().height) - g.cy;
      const double most = (plane.slope >= kUprightSlope ? 0.5 : 2) * quarters.block_px;
      const Eigen::Vector2d p = surely_on(plane, g, {u, v}, most, variance);
      const double d = plane.disparity.dot(p.homogeneous());
      plane.outline_camera.push_back(
          plane.plane_camera.project(g.point(p.x(), p.y(), std::max(d, least))));
    }
  }
}

FloorFrontend::FloorFrontend(const FloorOptions& options)
    : state_(std::make_unique<State>(checked(options))) {}
FloorFrontend::~FloorFrontend() = default;
FloorFrontend::FloorFrontend(FloorFrontend&&) noexcept = default;
FloorFrontend& FloorFrontend::operator=(FloorFrontend&&) noexcept = default;

const DisparityImage& FloorFrontend::disparities() const { return state_->extractor.image(); }

const FloorOptions& FloorFrontend::options() const { return state_->options; }

void FloorFrontend::begin(const SE3& T_body_camera_calibrated, const Leveling& mounting) {
  state_->judge.begin(T_body_camera_calibrated, mounting);
}

void FloorFrontend::expect_ground(const Leveling& sigma) { state_->judge.expect_ground(sigma); }

bool FloorFrontend::calibration_wrong() const { return state_->judge.calibration_wrong(); }
bool FloorFrontend::floor_off() const { return state_->judge.off(); }
void FloorFrontend::accept_knocks(bool accepted) { state_->judge.accept_knocks(accepted); }

void FloorFrontend::save(ArchiveWriter& archive) const { archive(state_->judge); }
void FloorFrontend::load(ArchiveReader& archive) { archive(state_->judge); }

void FloorFrontend::reset() { state_->judge = FloorJudge(state_->options); }

FloorResult FloorFrontend::process(const DepthFrame& frame) {
  State& s = *state_;
  FloorResult result;
  result.stamp = frame.stamp;
  result.sensor = frame.camera.noise.kind == DepthNoise::Kind::kStereo ? SensorKind::kStereo
                                                                       : SensorKind::kDepth;
  const SE3& calibrated = frame.camera.camera.T_body_camera;
  const FloorPrior prior = s.judge.prior(calibrated);
  s.extractor.extract(frame, {prior.T_body_camera, prior.knowledge != MountingKnowledge::kUnknown});
  result.times = s.extractor.times();
  result.skipped_sections = s.extractor.skipped_sections();
  result.noise_scale = s.extractor.noise_scale();

  Stopwatch watch;
  s.collect_planes(result);
  std::swap(result.pixel_labels, s.extractor.pixel_labels());
  const BlockImage& blocks = s.extractor.blocks();
  result.blocks = {blocks.size, blocks.columns, blocks.rows, s.extractor.block_labels()};
  s.judge.judge(calibrated, static_cast<double>(frame.width()) * frame.height(), result);
  s.mark_uncertain_borders(result);
  double measured = 0;
  for (const Block& block : blocks.blocks) measured += static_cast<double>(block.n);
  if (measured < s.options.min_plane_px) {
    result.status = FloorStatus::kNoData;
    result.reason = "hardly any measurement in the frame";
  }
  s.trace(result);
  result.times.output_ms = watch.lap();

  s.mapper.map(s.extractor, result);
  make_surfels(s.extractor, s.options, result);
  result.times.surface_ms = watch.lap();
  return result;
}

FloorResult FloorFrontend::process(const CloudFrame& frame) {
  FloorResult result;
  result.stamp = frame.stamp;
  result.sensor = SensorKind::kCloud;
  state_->cloud.process(frame, state_->judge, result);
  return result;
}

}  // namespace lamina
