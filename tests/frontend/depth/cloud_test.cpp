// Clouds take the document's steps through PCL; the fast way must agree with them.
#include <gtest/gtest.h>

#include <lamina/frontend/depth/floor_frontend.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

using namespace testing;

CloudFrame cloud_of(const DepthFrame& frame, int step) {
  CloudFrame cloud;
  cloud.T_body_sensor = frame.camera.camera.T_body_camera;
  for (int v = 0; v < frame.height(); v += step) {
    for (int u = 0; u < frame.width(); u += step) {
      if (frame.raw_at(u, v) > 0) {
        cloud.points_sensor.push_back(frame.point_camera(u, v).cast<float>());
      }
    }
  }
  cloud.width = static_cast<int>(cloud.points_sensor.size());
  return cloud;
}

TEST(CloudPlanes, AgreeWithTheFastWay) {
  const DepthFrame frame =
      draw({floor_piece(), wall_piece(3), square_piece(1.8, 0.3, 0.35, 0.15)}, test_camera(), 0.05);
  FloorFrontend fast, slow;
  const FloorResult a = fast.process(frame), b = slow.process(cloud_of(frame, 4));
  ASSERT_EQ(a.status, FloorStatus::kFound);
  ASSERT_EQ(b.status, FloorStatus::kFound) << b.reason;
  EXPECT_LT(angle_between(*a.floor_camera, *b.floor_camera), 0.2 * M_PI / 180);
  EXPECT_NEAR(a.floor_camera->rho(), b.floor_camera->rho(), 0.004);
  EXPECT_NEAR(b.surface.height_at({1.8, 0.3}).value_or(-1), 0.15, 0.01);
  // Each plane of the fast way inside the region of interest is one of the cloud's.
  for (const ExtractedPlane& p : a.planes) {
    bool met = false;
    for (const ExtractedPlane& q : b.planes) {
      met |= angle_between(p.plane_camera, q.plane_camera) < 0.03 &&
             std::abs(p.plane_camera.rho() - q.plane_camera.rho()) < 0.03;
    }
    EXPECT_TRUE(met) << "slope " << p.slope << " height " << p.height;
  }
  const Observations o = b.to_observations();
  EXPECT_EQ(o.sensor, SensorKind::kCloud);
  EXPECT_EQ(o.planes.size(), b.planes.size());
  EXPECT_FALSE(o.floor_patches.empty());
}

TEST(CloudPlanes, EmptyAndSenselessCloudsGiveNoPlanes) {
  FloorFrontend frontend;
  CloudFrame cloud;
  EXPECT_EQ(frontend.process(cloud).status, FloorStatus::kNoData);
  cloud.points_sensor.assign(500, Eigen::Vector3f::Constant(std::nanf("")));
  EXPECT_EQ(frontend.process(cloud).status, FloorStatus::kNoData);
  cloud.points_sensor.assign(500, Eigen::Vector3f(1, 0, 0));
  EXPECT_TRUE(frontend.process(cloud).planes.empty());
}

}  // namespace
}  // namespace lamina
