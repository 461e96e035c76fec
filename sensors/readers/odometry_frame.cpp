// Upright first, then the hand of its axes.
#include <lamina/sensors/readers/odometry_frame.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <utility>

namespace lamina {
namespace {

using Samples = std::vector<Odometry>;

double upright_share(const Samples& samples, double cosine) {
  const auto stands = [cosine](const Odometry& o) {
    return (o.T_odom_body.so3() * Eigen::Vector3d::UnitZ()).z() >= cosine;
  };
  return static_cast<double>(std::count_if(samples.begin(), samples.end(), stands)) /
         static_cast<double>(std::max<std::size_t>(1, samples.size()));
}

Samples with_w_first(const Samples& samples) {
  Samples all = samples;
  for (Odometry& o : all) {
    const Eigen::Quaterniond q = o.T_odom_body.so3().quaternion();
    o.T_odom_body =
        SE3(SO3(Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w())), o.T_odom_body.translation());
  }
  return all;
}

Samples of_camera(const Samples& samples, const SE3& T_body_camera) {
  Samples all = samples;
  for (Odometry& o : all) o.T_odom_body = o.T_odom_body * T_body_camera.inverse();
  return all;
}

std::optional<Warning> stand_up(Samples& samples, const std::optional<SE3>& T_body_camera,
                                const OdometryFrameOptions& options) {
  const double share = upright_share(samples, options.upright);
  if (share >= options.most_stand) return std::nullopt;
  const auto explains = [&](const Samples& other) {
    return upright_share(other, options.upright) >= options.all_stand;
  };
  const auto warning = [share](const char* cause) {
    char text[400];
    std::snprintf(text, sizeof text,
                  "odometry.txt: by its poses the body stands upright %.0f %% of the time, and all "
                  "of it if %s: read so",
                  100 * share, cause);
    return Warning{"odometry_frame", text};
  };
  if (Samples other = with_w_first(samples); explains(other)) {
    samples = std::move(other);
    return warning("its quaternions are w, x, y, z instead of x, y, z, w");
  }
  if (!T_body_camera) return std::nullopt;
  if (Samples other = of_camera(samples, *T_body_camera); explains(other)) {
    samples = std::move(other);
    return warning("they are those of the camera's optical frame instead of the body's");
  }
  return std::nullopt;
}

// How ways turn with headings.
struct Hand {
  double same = 0, all = 0;  // sums of sines of turns of ways times those of headings; squares
  double turned = 0;         // rad of headings, without sign
  std::complex<double> left, twice;  // sums of unit directions: way plus heading, and twice that
  double steps = 0;
  double sign() const { return all > 0 ? same / all : 0; }  // 1: alike, -1: against each other
};

Hand hand_of(const Samples& samples, double step) {
  Hand hand;
  std::optional<std::pair<double, double>> last;  // direction of the way, heading
  for (std::size_t from = 0, to = 1; to < samples.size(); ++to) {
    const SE3 &a = samples[from].T_odom_body, &b = samples[to].T_odom_body;
    const Eigen::Vector3d way = b.translation() - a.translation();
    if (way.head<2>().norm() < step) continue;
    from = to;
    const double turn = std::remainder(b.so3().yaw() - a.so3().yaw(), 2 * M_PI);
    const double direction = std::atan2(way.y(), way.x()), heading = a.so3().yaw() + turn / 2;
    if (last) {
      const double turned = std::sin(heading - last->second);
      hand.same += std::sin(direction - last->first) * turned;
      hand.all += turned * turned;
      hand.turned += std::abs(turned);
    }
    last = {direction, heading};
    hand.left += std::polar(1.0, direction + heading);
    hand.twice += std::polar(1.0, 2 * (direction + heading));
    ++hand.steps;
  }
  return hand;
}

std::optional<Warning> right_hand(Samples& samples, const OdometryFrameOptions& options) {
  const Hand hand = hand_of(samples, options.step);
  if (hand.turned < options.least_turned || hand.sign() > -options.against) return std::nullopt;
  const bool ahead = 2 * std::abs(hand.left) > hand.steps;
  double angle = ahead ? std::arg(hand.left) : std::arg(hand.twice) / 2;
  const double quarters = M_PI_2 * std::round(angle / M_PI_2);
  if (std::abs(angle - quarters) < options.quarter) angle = quarters;
  const double c = std::cos(angle), s = std::sin(angle);
  for (Odometry& o : samples) {
    const Eigen::Vector3d p = o.T_odom_body.translation();
    o.T_odom_body = SE3(o.T_odom_body.so3(), {c * p.x() + s * p.y(), s * p.x() - c * p.y(), p.z()});
  }
  char text[400];
  std::snprintf(text, sizeof text,
                "odometry.txt: its positions turn the other way than its headings (by %.2f of "
                "them): x and y are swapped, or one has the wrong sign. Positions were mirrored; "
                "if headings are what is wrong, the map is a mirror image",
                -hand.sign());
  return Warning{"odometry_axes", text};
}

}  // namespace

std::vector<Warning> mend_odometry_frame(Samples& samples, const std::optional<SE3>& T_body_camera,
                                         const OdometryFrameOptions& options) {
  std::vector<Warning> all;
  if (auto found = stand_up(samples, T_body_camera, options)) all.push_back(*std::move(found));
  if (auto found = right_hand(samples, options)) all.push_back(*std::move(found));
  return all;
}

}  // namespace lamina
