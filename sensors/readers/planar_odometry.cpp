// Heights and tilts of a whole recording's odometry.
#include <lamina/sensors/readers/planar_odometry.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lamina {

OffPlane off_plane(const Trajectory& odometry) {
  OffPlane result;
  if (odometry.size() < 2) return result;
  std::vector<double> heights;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const StampedPose& sample : odometry) {
    heights.push_back(sample.pose.translation().z());
    up += sample.pose.so3() * Eigen::Vector3d::UnitZ();
  }
  up.normalize();
  double squares = 0;
  for (const StampedPose& sample : odometry)
    squares += up.cross(sample.pose.so3() * Eigen::Vector3d::UnitZ()).squaredNorm();
  result.tilt = std::sqrt(squares / static_cast<double>(odometry.size()));
  std::sort(heights.begin(), heights.end());
  const std::size_t edge = heights.size() / 20;
  result.height = heights[heights.size() - 1 - edge] - heights[edge];
  return result;
}

void settle_planar(const Trajectory& odometry, bool stated, Calibration& calibration,
                   std::vector<std::string>& remarks, std::vector<Warning>& warnings) {
  const OffPlane off = off_plane(odometry);
  char text[300];
  std::snprintf(text, sizeof text, "its heights vary by %.2f m and it tilts by %.1f deg rms",
                off.height, off.tilt * 180 / M_PI);
  if (!stated && off.leaves()) {
    calibration.odometry.planar = false;
    remarks.push_back(std::string("odometry.planar: false, as the odometry shows: ") + text);
  } else if (stated && calibration.odometry.planar && off.flies()) {
    warnings.push_back({"odometry_not_planar",
                        std::string("odometry.planar is stated true, but of the odometry ") + text +
                            ": heights and tilts are left out of the motion; without the key they "
                            "are used"});
  }
}

}  // namespace lamina
