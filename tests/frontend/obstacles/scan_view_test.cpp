// Lines outward follow the floor of pitched, rolled and downward cameras.
#include <gmock/gmock.h>

#include <lamina/frontend/obstacles/scan_view.hpp>

#include "frontend/obstacles/depth_scene.hpp"

namespace lamina {
namespace {

TEST(ScanView, LinesFollowTheirAzimuthOutward) {
  for (const double roll : {0.0, 0.2}) {
    for (const double pitch : {0.0, 0.5, 1.3}) {
      DepthFrame f = empty_frame(pitch);
      SE3& T = f.camera.camera.T_body_camera;
      T = SE3(SO3::rot_x(roll) * T.so3(), T.translation());
      DisparityImage image;
      fill_disparity(f, image);
      const ScanView view(f, image, T);
      int lines = 0;
      for (double a = view.azimuth_from; a < view.azimuth_to; a += 0.05) {
        const WalkLine line = view.line(a);
        double last = 0;
        for (int i = 0; i < line.samples; ++i) {
          const auto k = static_cast<float>(i);
          const Eigen::Vector3d ray = view.ray(static_cast<double>(line.u0 + k * line.du),
                                               static_cast<double>(line.v0 + k * line.dv));
          if (ray.z() > -0.01) continue;
          const Eigen::Vector3d p = ray * (-view.height() / ray.z());
          const double range = p.head<2>().norm();
          EXPECT_GE(range, last - 1e-3);
          if (range > 0.05) {
            EXPECT_NEAR(std::remainder(std::atan2(p.y(), p.x()) - a, 2 * M_PI), 0, 2e-3);
          }
          last = range;
        }
        lines += line.samples > 0;
      }
      EXPECT_GT(lines, 5);
    }
  }
}

TEST(ScanView, QuickArctangent) {
  for (double a = -3.14; a < 3.14; a += 0.01) {
    EXPECT_NEAR(
        quick_atan2(static_cast<float>(2 * std::sin(a)), static_cast<float>(2 * std::cos(a))), a,
        3e-6);
  }
}

}  // namespace
}  // namespace lamina
