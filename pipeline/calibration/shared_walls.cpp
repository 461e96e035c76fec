// Pairs of walls and lines, and their least squares.
#include <lamina/pipeline/calibration/shared_walls.hpp>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kUpright = 8 * kDegree;    // of a wall against the vertical, at most
constexpr double kMostAngle = 8 * kDegree;  // between wall and line
constexpr double kMostDistance = 0.25;      // m, likewise
constexpr double kLeastOverlap = 0.3;       // m that both see
constexpr double kMostWay = 0.3;            // m that the robot may move between scan and image
constexpr int kLeastPairs = 30, kLeastViews = 5, kMostViews = 50;
// Another view: what an image errs by slowly is new there.
constexpr double kOtherPlace = 0.5, kOtherHeading = 0.3;  // m, rad
// What a wall is not: plane, and the same at the scanner's height and in the image.
constexpr double kAngleFloor = 0.3 * kDegree, kDistanceFloor = 0.01;  // rad, m
constexpr double kHeadingPrior = 1.5 * kDegree, kPlacePrior = 0.02;   // rad, m
// What one camera's images err by in common, and views do not average: without errors of heading,
// slow distortion of 0.2 px made 0.4 degrees and 1.1 cm in one of six drawn corridors and offices.
constexpr double kHeadingCommon = 0.2 * kDegree, kPlaceCommon = 0.007;  // rad, m
constexpr double kSignificant = 11.3;  // 99 % of chi-squared of 3 degrees

struct Interval {
  double low = 1e30, high = -1e30;
  void add(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  double overlap(const Interval& o) const { return std::min(high, o.high) - std::max(low, o.low); }
  double middle(const Interval& o) const {
    return 0.5 * (std::min(high, o.high) + std::max(low, o.low));
  }
};

// How far a plane, seen across, goes.
Interval extent_along(const Eigen::Vector2d& along, const SE3& T,
                      const std::vector<Eigen::Vector3d>& points) {
  Interval extent;
  for (const Eigen::Vector3d& p : points) extent.add(along.dot((T * p).head<2>()));
  return extent;
}

// Of a pair's angle and distance, by their sigmas, and their derivatives by the correction.
struct Residuals {
  double angle, distance;
  Eigen::RowVector3d by_angle, by_distance;
};

// A wall turned by x(0) about the camera and moved by (x(1), x(2)).
template <class Pair>
Residuals residuals(const Pair& pair, const Eigen::Vector3d& x) {
  const Eigen::RowVector3d by_angle(-1, 0, 0);
  const Eigen::Vector2d turned(-pair.offset.y(), pair.offset.x());
  const Eigen::RowVector3d by_distance(-pair.normal.dot(turned), -pair.normal.x(),
                                       -pair.normal.y());
  return {(pair.angle + by_angle * x) / pair.angle_sigma,
          (pair.distance + by_distance * x) / pair.distance_sigma, by_angle / pair.angle_sigma,
          by_distance / pair.distance_sigma};
}

}  // namespace

struct SharedWalls::Line {
  Eigen::Vector2d start, end;          // in the image's body frame
  double angle_sigma, distance_sigma;  // rad, m
};

std::vector<SharedWalls::Line> SharedWalls::lines_in(const Observations& scan,
                                                     const SE3& T_image_scan) {
  std::vector<Line> lines;
  const SE3 T = T_image_scan * scan.T_body_sensor;
  for (const SegmentObservation& o : scan.segments) {
    const Eigen::Vector3d start = T * Eigen::Vector3d(o.segment.start.x(), o.segment.start.y(), 0);
    const Eigen::Vector3d end = T * Eigen::Vector3d(o.segment.end.x(), o.segment.end.y(), 0);
    lines.push_back({start.head<2>(), end.head<2>(),
                     std::sqrt(std::max(0.0, o.segment.covariance(1, 1))), o.floor.sigma_rho});
  }
  return lines;
}

void SharedWalls::add_scan(const Observations& scan, const SE3& T_start_body) {
  scan_ = scan;
  T_start_scan_body_ = T_start_body;
}

std::optional<SharedWalls::Pair> SharedWalls::nearest_line(const Observations& image,
                                                           const PlaneObservation& o,
                                                           const std::vector<Line>& lines) {
  const Plane wall = image.T_body_sensor * o.plane_sensor;
  if (std::abs(wall.normal().z()) > std::sin(kUpright)) return std::nullopt;
  const Eigen::Vector2d n = wall.normal().head<2>(), along(-n.y(), n.x());  // as long as n
  const Interval seen = extent_along(along, image.T_body_sensor, o.outline_sensor);
  // Of a wall that leans, where its middle is high.
  const double middle_z = (image.T_body_sensor * o.moments_sensor.mean()).z();
  const double rho = wall.rho() - wall.normal().z() * middle_z;
  const double extent = std::max(0.1, (seen.high - seen.low) / std::sqrt(12.0));
  const double lean = std::max(o.floor.sigma_tilt, o.floor.sigma_bend / extent);
  std::optional<Pair> nearest;
  for (const Line& line : lines) {
    Eigen::Vector2d way = line.end - line.start;
    if (way.dot(along) < 0) way = -way;
    const double angle = std::atan2(along.x() * way.y() - along.y() * way.x(), along.dot(way));
    Interval observed;
    observed.add(along.dot(line.start));
    observed.add(along.dot(line.end));
    if (std::abs(angle) > kMostAngle || seen.overlap(observed) < kLeastOverlap) continue;
    // The line's point in the middle of what both see.
    const double s =
        (seen.middle(observed) - along.dot(line.start)) / along.dot(line.end - line.start);
    const Eigen::Vector2d q = line.start + s * (line.end - line.start);
    const double distance = n.dot(q) - rho;
    if (std::abs(distance) > kMostDistance ||
        (nearest && std::abs(nearest->distance) <= std::abs(distance))) {
      continue;
    }
    const Eigen::Vector3d angles(line.angle_sigma, lean, kAngleFloor);
    const Eigen::Vector3d distances(line.distance_sigma, o.floor.sigma_rho, kDistanceFloor);
    const Eigen::Vector2d offset = q - image.T_body_sensor.translation().head<2>();
    nearest = Pair{angle, distance, angles.norm(), distances.norm(), n, offset, image.stamp};
  }
  return nearest;
}

void SharedWalls::add_image(const Observations& image, const SE3& T_start_body) {
  if (!scan_) return;
  const SE3 T_image_scan = T_start_body.inverse() * T_start_scan_body_;
  if (T_image_scan.translation().norm() > kMostWay) return;
  const std::vector<Line> lines = lines_in(*scan_, T_image_scan);
  const std::size_t before = pairs_.size();
  for (const PlaneObservation& o : image.planes) {
    if (const auto pair = nearest_line(image, o, lines)) pairs_.push_back(*pair);
  }
  if (pairs_.size() == before) return;
  const SE3 moved = T_start_last_ ? T_start_last_->inverse() * T_start_body : SE3();
  if (!T_start_last_ || moved.translation().norm() > kOtherPlace ||
      moved.so3().log().norm() > kOtherHeading) {
    T_start_last_ = T_start_body;
    ++views_;
  }
}

Adoption SharedWalls::adoption() const {
  BlockEvidence<3> evidence;
  for (const Pair& pair : pairs_) {
    const Eigen::Vector2d turned(-pair.offset.y(), pair.offset.x());
    evidence.add(pair.stamp, {1, 0, 0}, pair.angle, pair.angle_sigma);
    evidence.add(pair.stamp, {pair.normal.dot(turned), pair.normal.x(), pair.normal.y()},
                 pair.distance, pair.distance_sigma);
  }
  const auto found = evidence.solve({kHeadingPrior, kPlacePrior, kPlacePrior}, {0, 1, 2});
  return found ? found->adoption : Adoption();
}

std::optional<SharedWalls::Result> SharedWalls::result() const {
  if (static_cast<int>(pairs_.size()) < kLeastPairs || views_ < kLeastViews) return std::nullopt;
  const Eigen::Array3d prior(kHeadingPrior, kPlacePrior, kPlacePrior);
  const Eigen::Vector3d known = prior.square().inverse().matrix();
  const double share = std::min(kMostViews, views_) / static_cast<double>(pairs_.size());
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  Eigen::Matrix3d H;
  double inliers = 0;
  constexpr int kRounds = 12;
  for (int round = 0; round < kRounds; ++round) {
    const double width = 3 * std::max(1.0, 6.0 / (1 + round));
    H.setZero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    inliers = 0;
    for (const Pair& pair : pairs_) {
      const auto [a, d, ja, jd] = residuals(pair, x);
      const double weight = share / (1 + (a * a + d * d) / (width * width));
      H += weight * (ja.transpose() * ja + jd.transpose() * jd);
      g += weight * (ja.transpose() * a + jd.transpose() * d);
      if (a * a + d * d < width * width) ++inliers;
    }
    H.diagonal() += known;
    g += known.cwiseProduct(x);
    x -= H.ldlt().solve(g);
  }
  if (2 * inliers < static_cast<double>(pairs_.size()) || !x.allFinite()) return std::nullopt;
  Eigen::Matrix3d covariance = H.inverse();
  const Eigen::Vector3d common(kHeadingCommon, kPlaceCommon, kPlaceCommon);
  covariance.diagonal() += common.cwiseAbs2();
  const Adoption by_blocks = adoption();
  return Result{{{0, 0, x(0)}, {x(1), x(2), 0}},
                covariance.diagonal().cwiseSqrt(),
                static_cast<int>(pairs_.size()),
                by_blocks,
                by_blocks.adopted && x.dot(covariance.ldlt().solve(x)) >= kSignificant};
}

}  // namespace lamina
