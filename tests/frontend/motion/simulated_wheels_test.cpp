// A depth camera beside right wheels in a simulated room.
#include <gtest/gtest.h>

#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/sensors/odometry.hpp>
#include <lamina/sim/sim_recording.hpp>

namespace lamina {
namespace {

// A camera at eye's height that looks a little up comes to a corner and turns aside there. The
// wheels' noise, half a degree, lays the wall beside itself, and half a metre along it the image
// fits no better than where the wheels, with their noise, have it.
TEST(DepthOdometry, WheelsThatTurnABitTooFarBeforeAWallAreNotOverruled) {
  sim::Simulation room(sim::make_scene("room", {{"lidar.enabled", "off"},
                                                {"odometry.enabled", "off"},
                                                {"camera.rate_hz", "3"},
                                                {"camera.width", "160"},
                                                {"camera.height", "120"},
                                                {"camera.pitch_deg", "-8"},
                                                {"camera.height_m", "1.2"},
                                                {"path.speed", "0.7"},
                                                {"path.turn_rate", "1"}}),
                       4);
  constexpr int kToTheWall = 8;  // images; then it turns
  DepthOdometry odometry;
  SE3 T_world_last;
  for (int i = 0; i < kToTheWall + 2; ++i) {
    const DepthFrame frame = std::get<DepthFrame>(*room.next());
    const SE3 T_world_body = room.pose_at(frame.stamp);
    const SE3 moved = i == 0 ? SE3() : T_world_last.inverse() * T_world_body;
    T_world_last = T_world_body;
    const SE3 counted = moved * SE3::planar(0, 0, i > kToTheWall ? 0.01 : 0);
    const MotionGuess wheels{counted, increment_covariance(OdometryModel(), counted)};
    const DepthMotion motion = odometry.process(frame, wheels);
    EXPECT_EQ(motion.against_wheels_m, 0) << i;
    EXPECT_LT((moved.inverse() * motion.T_prev_curr_body).translation().norm(), 0.03) << i;
  }
}

}  // namespace
}  // namespace lamina
