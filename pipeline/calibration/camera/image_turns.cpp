// Depth odometry, begun anew wherever images were passed over.
#include <lamina/pipeline/calibration/camera/image_turns.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/sensors/depth_images.hpp>

namespace lamina {
namespace {

// The turn rate changes nearby.
bool tells(const TurnTrack& turns, Timestamp stamp, double around) {
  constexpr double kStep = 0.125, kRates = 0.15;  // s, s, rad/s
  double low = 1e300, high = -1e300;
  for (double at = -around; at < around - 1e-9; at += kStep) {
    const auto rate = turns.rate(stamp + at, stamp + (at + kStep));
    if (!rate) continue;
    low = std::min(low, *rate);
    high = std::max(high, *rate);
  }
  return high - low > kRates;
}

// Images from a stamp on that may be passed over.
std::int64_t untelling(const Wheels& wheels, Timestamp stamp, double interval, double around) {
  constexpr double kStep = 0.125;  // s
  double way = 0;
  while (stamp + way < wheels.last && !tells(wheels.turns, stamp + way, around)) way += kStep;
  return std::max<std::int64_t>(0, static_cast<std::int64_t>(way / interval) - 2);
}

}  // namespace

std::optional<MotionGuess> loose(const std::optional<Increment>& moved) {
  constexpr double kMetres = 0.05, kRadians = 0.05;
  if (!moved) return std::nullopt;
  MotionGuess guess{moved->T_from_to, moved->covariance};
  guess.covariance.diagonal().head<3>().array() += kMetres * kMetres;
  guess.covariance.diagonal().tail<3>().array() += kRadians * kRadians;
  return guess;
}

std::optional<DepthFrame> next_image(Recording& recording, std::int64_t skip) {
  if (recording.calibration().depth_camera) return next_depth_image(recording, skip);
  try {
    while (auto measurement = recording.next()) {
      const auto* pair = std::get_if<StereoFrame>(&*measurement);
      if (pair && skip-- <= 0) return depth_from_stereo(*pair);
    }
  } catch (const Error&) {  // the run itself comes to it, and says so
  }
  return std::nullopt;
}

void Wheels::add(const Odometry& odometry) {
  if (turns.empty()) first = odometry.stamp;
  last = odometry.stamp;
  ++count;
  turns.add(odometry.stamp, odometry.T_odom_body);
  track.add(odometry);
}

Wheels wheels_of(Recording& recording, const std::function<bool()>& ended) {
  Wheels wheels(recording.calibration().odometry);
  try {
    while (!ended()) {
      const auto measurement = recording.next_light();
      if (!measurement) break;
      if (const auto* odometry = std::get_if<Odometry>(&*measurement)) wheels.add(*odometry);
    }
  } catch (const Error&) {
  }
  return wheels;
}

void turns_by_images(Recording& recording, const Wheels& wheels, const DepthDistortion& distortion,
                     double around, const std::function<bool()>& ended,
                     const std::function<bool(const ImageTurn&)>& visit) {
  constexpr double kLongest = 0.5, kShortest = 0.06;  // s between images that are matched
  DepthOdometry odometry;
  std::optional<Timestamp> last, before;  // matched, seen
  double interval = 0;
  std::int64_t skip = 0;
  while (!ended()) {
    auto frame = next_image(recording, skip);
    if (!frame) return;
    const Timestamp stamp = frame->stamp;
    if (before && skip == 0) interval = stamp - *before;
    before = stamp;
    skip = 0;
    if (!tells(wheels.turns, stamp, around)) {
      if (interval > 0) skip = untelling(wheels, stamp, interval, around);
      continue;
    }
    if (last && stamp - *last < kShortest) continue;
    const bool follows = last && stamp - *last <= kLongest;
    if (!follows) odometry = DepthOdometry();
    distortion.correct(*frame);
    const DepthMotion motion = odometry.process(
        *frame, follows ? loose(wheels.track.between(*last, stamp)) : std::nullopt);
    Matrix6d information = motion.image_information;
    information.diagonal().array() += 1;  // a metre, a radian: what is open stays finite
    ImageTurn turn{last.value_or(stamp), stamp, motion.T_prev_curr_body.so3().yaw(),
                   std::sqrt(information.inverse()(5, 5))};
    const bool measured = motion.status == ScanMotion::Status::kTracked ||
                          motion.status == ScanMotion::Status::kDegenerate;
    turn.matched = follows && measured;
    turn.explained = motion.explained;
    turn.observed = turn.matched && turn.explained && !motion.doubtful;
    last = stamp;
    if (!visit(turn)) return;
  }
}

}  // namespace lamina
