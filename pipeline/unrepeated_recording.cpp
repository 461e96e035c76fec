// Contents by their hash.
#include <lamina/pipeline/unrepeated_recording.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include <lamina/models/content_hash.hpp>

namespace lamina {
namespace {

std::uint64_t place_hash(const SE3& T) {
  const Eigen::Vector4d q = T.so3().quaternion().coeffs();
  const Eigen::Vector3d p = T.translation();
  return content_hash(std::vector<double>{q(0), q(1), q(2), q(3), p(0), p(1), p(2)});
}

bool has_returns(const LaserScan& scan) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.valid(i)) return true;
  }
  return false;
}

}  // namespace

bool Repeats::add(Timestamp stamp, std::uint64_t sensor, std::uint64_t content,
                  const std::optional<SE3>& T_odom_body) {
  ++all_;
  const auto [place, first] = last_.try_emplace(sensor, Last{content, T_odom_body});
  Last& last = place->second;
  if (first || content != last.content || !T_odom_body || !last.T_odom_body) {
    last = {content, T_odom_body};
    return false;
  }
  const Vector6d moved = (last.T_odom_body->inverse() * *T_odom_body).log();
  if (moved.head<3>().norm() < options_.moved && moved.tail<3>().norm() < options_.turned)
    return false;
  farthest_ = std::max(farthest_, moved.head<3>().norm());
  if (!first_) first_ = stamp;
  ++repeated_;
  return true;
}

std::optional<Warning> Repeats::warning(const std::string& id, const std::string& what) const {
  if (repeated_ < options_.few) return std::nullopt;
  return Warning{id, fmt::format("{} of {} {} repeat the one before, number by number, though the "
                                 "odometry moves (by up to {:.2f} m meanwhile; first at {} s): the "
                                 "sensor or its driver hung. They were left out, the motion there "
                                 "is the odometry's",
                                 repeated_, all_, what, farthest_, first_->to_string())};
}

std::optional<Measurement> UnrepeatedRecording::checked(std::optional<Measurement> measurement) {
  if (!measurement) return measurement;
  if (const auto* odometry = std::get_if<Odometry>(&*measurement)) {
    T_odom_body_ = odometry->T_odom_body;
  } else if (auto* scan = std::get_if<LaserScan>(&*measurement); scan && has_returns(*scan)) {
    if (scans_.add(scan->stamp, place_hash(scan->lidar.T_body_lidar), content_hash(scan->ranges),
                   T_odom_body_))
      std::fill(scan->ranges.begin(), scan->ranges.end(), std::numeric_limits<float>::quiet_NaN());
  } else if (auto* depth = std::get_if<DepthFrame>(&*measurement)) {
    if (images_.add(depth->stamp, 0, content_hash(depth->raw), T_odom_body_))
      std::fill(depth->raw.begin(), depth->raw.end(), std::uint16_t{0});
  } else if (auto* pair = std::get_if<StereoFrame>(&*measurement)) {
    if (images_.add(pair->stamp, 0, content_hash(pair->left), T_odom_body_)) {
      std::fill(pair->left.begin(), pair->left.end(), std::uint8_t{0});
      std::fill(pair->right.begin(), pair->right.end(), std::uint8_t{0});
    }
  }
  return measurement;
}

std::vector<Warning> UnrepeatedRecording::warnings() const {
  std::vector<Warning> all = source().warnings();
  if (auto scans = scans_.warning("scans_repeat", "scans")) all.push_back(*scans);
  if (auto images = images_.warning("images_repeat", "images")) all.push_back(*images);
  return all;
}

}  // namespace lamina
