// Looks past places, and the robot's way through them.
#include <lamina/grid/evidence/hidden_places.hpp>

namespace lamina {
namespace {

constexpr double kRobot = 0.15;   // m beside the path
constexpr double kOnFloor = 0.2;  // m between a robot's body frame and its floor

// Where the robot went nothing hangs.
void pass_robot(const Trajectory& path, std::vector<HiddenPlace>& places) {
  Squares<HiddenPlace> squares(places);
  for (const StampedPose& pose : path) {
    const Eigen::Vector3d& p = pose.pose.translation();
    squares.for_each_near(p, kRobot, [&](HiddenPlace& place) {
      const bool beside = (place.p_map - p).head<2>().norm() <= kRobot;
      if (beside && std::abs(place.floor - p.z()) <= kOnFloor) place.past = kLooksPast;
    });
  }
}

}  // namespace

void look_past(const Spool& looks, const Trajectory& path, std::vector<HiddenPlace>& places) {
  ask(looks, path, places,
      [](HiddenPlace& place, const DepthLook& look, const SE3&, const SE3& T_camera_map) {
        place.past += look.at(T_camera_map * place.p_map, kLookRadius) == Sight::kPast;
      });
  pass_robot(path, places);
}

}  // namespace lamina
