// Poses of the odometry by time, from the thread that reads to the one that maps.
#pragma once

#include <map>
#include <mutex>
#include <optional>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/timestamp.hpp>
#include <lamina/sensors/forwarding_recording.hpp>

namespace lamina::publish {

struct OdometryPosesOptions {
  std::size_t most = 20000;  ///< that are kept, the newest: minutes of any robot
  double near = 1;           ///< s from an end at which its pose is given
};

/// Keeps the newest. Thread-safe.
class OdometryPoses {
 public:
  explicit OdometryPoses(const OdometryPosesOptions& options = {}) : options_(options) {}
  void add(Timestamp stamp, const SE3& T_odom_body);
  /// At a stamp, between its neighbours or at the end that is nearest; nullopt where there is none
  /// near it.
  std::optional<SE3> at(Timestamp stamp) const;
  /// Whether none has come yet.
  bool empty() const {
    const std::lock_guard lock(mutex_);
    return poses_.empty();
  }

 private:
  OdometryPosesOptions options_;
  mutable std::mutex mutex_;
  std::map<Timestamp, SE3> poses_;
};

/// A recording whose odometry is noted as it is read.
class NotedOdometry final : public ForwardingRecording {
 public:
  NotedOdometry(std::unique_ptr<Recording> source, std::shared_ptr<OdometryPoses> poses)
      : ForwardingRecording(std::move(source)), poses_(std::move(poses)) {}
  std::optional<Measurement> next() override {
    auto measurement = source().next();
    if (const auto* odometry = measurement ? std::get_if<Odometry>(&*measurement) : nullptr)
      poses_->add(odometry->stamp, odometry->T_odom_body);
    return measurement;
  }

 private:
  std::shared_ptr<OdometryPoses> poses_;
};

}  // namespace lamina::publish
