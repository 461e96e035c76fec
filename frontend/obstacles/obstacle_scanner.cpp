// The steps of one frame.
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>

#include <cmath>

#include <lamina/frontend/obstacles/baseline_methods.hpp>
#include <lamina/frontend/obstacles/positive_scan.hpp>
#include <lamina/models/checked_cast.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sensors/usable_camera.hpp>

namespace lamina {
namespace {

constexpr double kDegree = 0.017453292519943295;

constexpr double kFullView = 0.8;  // m
// Of one image, two pixels apart all around in the longest lens there is.
constexpr int kMostLines = 20000;

ScanOptions checked(const ScanOptions& options) {
  const auto problems = options.problems();
  if (!problems.empty()) throw Error(problems.front());
  return options;
}

// Beams on a fixed lattice, so that small changes of the mounting do not move them; half a step
// off zero, where the columns of an image with an even width look.
ObstacleScan make_beams(const ScanView& view, Timestamp stamp, const ScanOptions& options) {
  const double step =
      options.angle_increment_deg > 0
          ? options.angle_increment_deg * kDegree
          : std::max(0.01, std::round(std::atan(1 / view.fx) / kDegree * 100) / 100) * kDegree;
  // Beams start at the body's origin: only those the image shows from kFullView on, so that none
  // reaches a far wall past ground beside the image.
  const double span = view.azimuth_to - view.azimuth_from;
  double trim = 0;
  if (span < M_PI) {
    const Eigen::Vector2d foot = view.t.head<2>();
    for (const double edge : {view.azimuth_from, view.azimuth_to}) {
      const double side = foot.x() * std::sin(edge) - foot.y() * std::cos(edge);
      trim = std::max(trim, std::asin(std::min(0.5, std::abs(side) / kFullView)));
    }
    trim = std::min(trim, 0.25 * span);
  }
  const double from = std::ceil((view.azimuth_from + trim) / step);
  const double to = std::floor((view.azimuth_to - trim) / step);
  const double beams = std::min(std::max(0.0, to - from), std::floor(2 * M_PI / step));
  const double range =
      options.range_max_m > 0 ? options.range_max_m : std::min(100.0, view.noise.max_range);
  return ObstacleScan::empty(stamp, (from + 0.5) * step, step, static_cast<std::size_t>(beams),
                             range);
}

}  // namespace

struct ObstacleScanner::State {
  explicit State(const ScanOptions& o) : options(o) {}

  ObstacleScan ours(const ScanView& view, const FloorResult& floor, ObstacleScan beams);
  ObstacleScan document(const ScanView& view, const ObstacleScan& beams) const;

  ScanOptions options;
  DisparityImage disparities;
  PositiveBuffers buffers;
  std::vector<WalkLine> lines;
  std::vector<WalkEnd> ends;
  std::vector<std::uint8_t> barred;
};

ObstacleScan ObstacleScanner::State::ours(const ScanView& view, const FloorResult& floor,
                                          ObstacleScan negative) {
  ObstacleScan positive = negative;
  WalkPlanes planes = walk_planes(floor, view, options);
  const std::span<const std::uint8_t> labels(floor.pixel_labels);
  lines.clear();
  ends.clear();
  barred.assign(negative.size(), 0);
  if (!planes.planes.empty()) {
    const double span = view.azimuth_to - view.azimuth_from;
    const double step = std::max(std::atan(1 / view.fx), span / kMostLines);
    const int count = to_whole(span / step, 0, kMostLines);
    for (int j = 0; j < count; ++j) {
      lines.push_back(view.line(view.azimuth_from + (j + 0.5) * step));
      ends.push_back(walk(view, lines.back(), labels, planes, options));
    }
    find_ledges(options, ends);
    settle_holes(planes, options, ends);
    extend_rims(ends);
    grow_rims(view, lines, planes, ends);
    smooth_edges(ends);
    draw_ends(view, lines, ends, negative, barred);
  }
  positive_scan(view, labels, planes, options, buffers, positive);
  if (!options.obstacles_beyond_knowledge) {
    for (std::size_t i = 0; i < positive.size(); ++i) {
      const double known =
          static_cast<double>(negative.range[i]) + (barred[i] != 0 ? 0 : options.max_faded_gap_m);
      if (negative.cause[i] != BeamCause::kEdgeOfKnowledge) continue;
      if (static_cast<double>(positive.range[i]) > known) positive.cause[i] = BeamCause::kNone;
    }
  }
  return combine(positive, negative);
}

ObstacleScan ObstacleScanner::State::document(const ScanView& view,
                                              const ObstacleScan& beams) const {
  ObstacleScan positive = beams, farthest = beams, below = beams;
  document_positive_scan(view, options.document_tolerance_m, options.robot_height_m, positive);
  document_farthest_point(view, options.document_tolerance_m, farthest);
  document_virtual_floor(view, options.document_tolerance_m, below);
  return combine(combine(farthest, below), positive);
}

ObstacleScanner::ObstacleScanner(const ScanOptions& options)
    : state_(std::make_unique<State>(checked(options))) {}
ObstacleScanner::~ObstacleScanner() = default;
ObstacleScanner::ObstacleScanner(ObstacleScanner&&) noexcept = default;
ObstacleScanner& ObstacleScanner::operator=(ObstacleScanner&&) noexcept = default;

const ScanOptions& ObstacleScanner::options() const { return state_->options; }

ObstacleScan ObstacleScanner::process(const DepthFrame& frame, const FloorResult& floor) {
  fill_disparity(frame, state_->disparities);
  return process(frame, floor, state_->disparities);
}

ObstacleScan ObstacleScanner::process(const DepthFrame& frame, const FloorResult& floor,
                                      const DisparityImage& disparities) {
  State& s = *state_;
  const CameraModel& camera = frame.camera.camera;
  if (disparities.d.empty() || !usable(camera) || frame.width() < 2) {
    return ObstacleScan::empty(frame.stamp, 0, 0.01, 0, 0);
  }
  LAMINA_CHECK(disparities.width == frame.width() && disparities.height == frame.height());
  const ScanView view(frame, disparities,
                      s.options.leveled ? floor.T_body_camera : camera.T_body_camera);
  ObstacleScan beams = make_beams(view, frame.stamp, s.options);
  if (s.options.method == NegativeMethod::kDocument) return s.document(view, beams);
  return s.ours(view, floor, std::move(beams));
}

}  // namespace lamina
