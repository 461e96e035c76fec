// Depth odometry between images, shared out to the steps between them.
#include <lamina/pipeline/calibration/slope_refinement.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/frontend/motion/out_of_plane_motion.hpp>
#include <lamina/sensors/depth_images.hpp>

namespace lamina {
namespace {

struct Stretch {            // of steps, from one image to the next
  std::size_t first, last;  // steps whose motions make it
  Increment image;          // what an image told of it; of height and tilt alone is made use
  bool observed;
};

// Motion and covariance of several steps after each other, open in height and tilt.
Increment open_motion(const std::vector<Step>& steps, std::size_t first, std::size_t last) {
  Increment sum{SE3(), Matrix6d::Zero()};
  double way = 0;
  for (std::size_t i = first; i <= last; ++i) {
    const Increment& one = steps[i].motion;
    const Matrix6d J = one.T_from_to.inverse().adjoint();
    sum.covariance = J * sum.covariance * J.transpose() + one.covariance;
    sum.T_from_to = sum.T_from_to * one.T_from_to;
    way += way_of(one);
  }
  return open_to_slopes(sum, way);
}

std::vector<Stretch> look(Recording& recording, const DepthDistortion& distortion,
                          const std::vector<Step>& steps, const std::function<bool()>& ended) {
  DepthOdometry odometry;
  std::optional<DepthFrame> last_level;
  std::vector<Stretch> stretches;
  bool follows = false;  // there is an image to compare with, at step `before`
  std::size_t before = 0, i = 0;
  while (!ended()) {
    auto frame = next_depth_image(recording, 0);
    if (!frame) break;
    // An image's step is the one of its stamp that is no scan's.
    while (i < steps.size() && (steps[i].observations.stamp < frame->stamp || steps[i].scan)) ++i;
    if (i == steps.size()) break;
    if (frame->stamp < steps[i].observations.stamp) continue;
    distortion.correct(*frame);
    frame->camera.camera.T_body_camera = steps[i].observations.T_body_sensor;
    if (!steps[i].slopes) {  // the last one before slopes come into view is what they begin from
      last_level = std::move(frame);
      follows = true;
      before = i++;
      continue;
    }
    if (last_level) {
      odometry = DepthOdometry();
      odometry.process(*last_level);
      last_level.reset();
    }
    if (!follows) {
      odometry.process(*frame);
    } else {
      const Increment level = open_motion(steps, before + 1, i);
      const DepthMotion motion =
          odometry.process(*frame, MotionGuess{level.T_from_to, level.covariance});
      const bool measured = motion.status == ScanMotion::Status::kTracked ||
                            motion.status == ScanMotion::Status::kDegenerate;
      const bool observed = measured && !motion.doubtful;
      const Increment image{motion.T_prev_curr_body, motion.covariance};
      stretches.push_back({before + 1, i, observed ? image : level, observed});
    }
    follows = true;
    before = i++;
  }
  return stretches;
}

// The steps' motions with their share of each stretch.
std::vector<Increment> lifted_motions(const std::vector<Step>& steps,
                                      const std::vector<Stretch>& stretches) {
  std::vector<Increment> motions;
  for (const Step& step : steps) motions.push_back(step.motion);
  for (const Stretch& stretch : stretches) {
    const auto begin = motions.begin() + static_cast<std::ptrdiff_t>(stretch.first);
    const auto end = motions.begin() + static_cast<std::ptrdiff_t>(stretch.last) + 1;
    share_out(stretch.image, {begin, end});
  }
  return motions;
}

bool changes_slope(const std::vector<SE3>& path) {
  constexpr double kWithin = 2, kLeast = 0.026;  // m of way; rad
  std::vector<double> way{0};
  for (std::size_t i = 1; i < path.size(); ++i) {
    way.push_back(way.back() + (path[i].translation() - path[i - 1].translation()).norm());
  }
  for (std::size_t i = 0, j = 0; i < path.size(); ++i) {
    while (way[i] - way[j] > kWithin) ++j;
    const Eigen::Vector3d up = path[i].so3() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d before = path[j].so3() * Eigen::Vector3d::UnitZ();
    if (up.cross(before).norm() > kLeast) return true;
  }
  return false;
}

}  // namespace

SlopesByImages follow_slopes(const OpenRecording& open, const DepthDistortion& distortion,
                             std::vector<Step>& steps, const std::function<bool()>& ended) {
  SlopesByImages result;
  const std::vector<Stretch> stretches = look(*open(), distortion, steps, ended);
  if (ended() || stretches.empty()) return result;
  const std::vector<Increment> motions = lifted_motions(steps, stretches);
  std::vector<SE3> path;
  for (const Increment& one : motions) {
    path.push_back(path.empty() ? one.T_from_to : path.back() * one.T_from_to);
    const SE3 T_first_body = path.front().inverse() * path.back();
    const Eigen::Vector3d up = T_first_body.so3() * Eigen::Vector3d::UnitZ();
    result.most_tilt = std::max(result.most_tilt, std::acos(std::clamp(up.z(), -1.0, 1.0)));
    result.lowest = std::min(result.lowest, T_first_body.translation().z());
    result.highest = std::max(result.highest, T_first_body.translation().z());
  }
  if (!changes_slope(path)) return result;
  const Eigen::Vector3d up_map = path.front().so3() * Eigen::Vector3d::UnitZ();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    steps[i].motion = motions[i];
    steps[i].observations.up_body = path[i].so3().inverse() * up_map;
  }
  for (const Stretch& stretch : stretches) result.observed += stretch.observed;
  return result;
}

}  // namespace lamina
