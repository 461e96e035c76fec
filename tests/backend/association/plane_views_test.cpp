// Views of one plane by images and by a scanner: each kind's errors are its own.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include <lamina/backend/association/plane_evidence.hpp>
#include <lamina/backend/mapper/mapper.hpp>

namespace lamina {
namespace {

constexpr double kWeight = 1e4;                                 // 1/m^2, of a point
constexpr double kAhead = 2, kHalfWidth = 0.1;                  // m: a narrow face across the way
const NoiseFloor kOfImages{0.015, 0.1}, kOfScans{0.005, 0.02};  // m, rad

// The face as an image has it, turned by `yaw` about the vertical.
PlaneObservation by_image(double yaw) {
  PlaneObservation seen;
  const Eigen::Vector3d n(-std::cos(yaw), -std::sin(yaw), 0), along(n.y(), -n.x(), 0);
  const Eigen::Vector3d middle(kAhead, 0, 0.5);
  seen.plane_sensor = Plane(n, n.dot(middle));
  for (int i = -10; i <= 10; ++i) {
    for (int j = -10; j <= 10; ++j) {
      seen.moments_sensor.add(
          middle + 0.1 * i * kHalfWidth * along + 0.05 * j * Eigen::Vector3d::UnitZ(), kWeight);
    }
  }
  for (const auto& [y, z] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
    seen.outline_sensor.push_back(middle + y * kHalfWidth * along + Eigen::Vector3d(0, 0, 0.5 * z));
  seen.floor = kOfImages;
  return seen;
}

SegmentObservation by_scan() {
  SegmentObservation seen;
  ScanSegment& s = seen.segment;
  s.rho = kAhead;
  s.theta = 0;
  s.start = {kAhead, -kHalfWidth};
  s.end = {kAhead, kHalfWidth};
  for (int i = -5; i <= 5; ++i) s.moments.add({kAhead, 0.2 * i * kHalfWidth, 0}, kWeight);
  seen.floor = kOfScans;
  return seen;
}

// Information on the yaw of a face across x (1/rad^2).
double of_yaw(const Moments& m) { return m.scatter()(1, 1); }

TEST(PlaneViews, OneKindSharesItsFloorAndTwoDoNot) {
  const PlaneEvidence image = make_evidence(by_image(0), SE3()),
                      line = make_evidence(by_scan(), SE3());
  PlaneViews views(line);
  EXPECT_TRUE(views.partial());
  EXPECT_EQ(&views.best(), &*views.lines());
  for (int i = 0; i < 3; ++i) views.join(image);
  views.join(line);
  EXPECT_FALSE(views.partial());
  EXPECT_EQ(&views.best(), &*views.full());
  EXPECT_EQ(views.full()->floor.sigma_tilt, kOfImages.sigma_tilt);
  EXPECT_EQ(views.lines()->floor.sigma_tilt, kOfScans.sigma_tilt);
  EXPECT_EQ(views.full()->moments_body.count(), 3 * image.moments_body.count());
  EXPECT_EQ(views.lines()->moments_body.count(), 2 * line.moments_body.count());
  PlaneViews other(image);
  other.join(views);
  EXPECT_EQ(other.full()->moments_body.count(), 4 * image.moments_body.count());
  EXPECT_EQ(other.lines()->moments_body.count(), 2 * line.moments_body.count());
}

// Images have the face turned by 5 degrees, which their noise floor allows for. Seen beside a scan
// its thousands of pixels were believed as far as the scan's floor would have them: the face was
// turned, and sure of it.
TEST(PlaneViews, AScansFloorIsNotThatOfImagesBesideIt) {
  constexpr double kTurned = 0.0873;  // rad
  Matrix6d covariance = Matrix6d::Identity() * 1e-10;
  Mapper mapper;
  for (int i = 0; i < 12; ++i) {
    Observations seen;
    seen.stamp = Timestamp::from_seconds(0.1 * i);
    if (i % 2 == 0) {
      seen.sensor = SensorKind::kDepth;
      seen.planes = {by_image(kTurned)};
    } else {
      seen.segments = {by_scan()};
    }
    mapper.add(seen, SE3(), covariance);
  }
  ASSERT_EQ(mapper.graph().plane_moments.size(), 1u);
  const Moments& m = mapper.graph().plane_moments.front().moments_body;
  const double images = 1 / (kOfImages.sigma_tilt * kOfImages.sigma_tilt);
  const double scans = 6 * of_yaw(by_scan().segment.moments);
  EXPECT_GT(of_yaw(m), 0.5 * scans);
  EXPECT_LT(of_yaw(m), 1.1 * (images + scans));
  const auto& plane = mapper.graph().planes.front().plane_anchor;
  const double yaw = std::asin(-plane.normal().y());
  EXPECT_LT(std::abs(yaw), 0.5 * kTurned);
}

// Each scan has the narrow face turned by its own noise. The first one's normal was the factor's,
// with the information of all of them.
TEST(PlaneViews, TheNormalIsThatOfAllLines) {
  const std::vector<double> turned{0.06, -0.02, -0.05, 0.03, -0.02};  // rad, mean 0
  const auto scan = [](double yaw) {
    SegmentObservation seen = by_scan();
    const SO3 turn = SO3::exp(Eigen::Vector3d(0, 0, yaw));
    const Eigen::Vector3d middle(kAhead, 0, 0);
    seen.segment.moments = seen.segment.moments.transformed(SE3(turn, middle - turn * middle));
    const Eigen::Vector3d n = turn * Eigen::Vector3d::UnitX();
    seen.segment.theta = yaw;
    seen.segment.rho = n.dot(middle);
    return make_evidence(seen, SE3());
  };
  PlaneViews lines(scan(turned[0]));
  for (std::size_t i = 1; i < turned.size(); ++i) lines.join(scan(turned[i]));
  EXPECT_LT(std::abs(lines.lines()->plane_body.normal().y()), 0.003);
  EXPECT_EQ(lines.lines()->plane_body.normal().z(), 0);
}

}  // namespace
}  // namespace lamina
