// A recording without what a sensor or driver that hung gave again and again.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lamina/sensors/forwarding_recording.hpp>

namespace lamina {

struct RepeatOptions {
  double moved = 0.01;    ///< m, or
  double turned = 0.005;  ///< rad: by so little more no two images or scans are the same
  std::int64_t few = 3;   ///< repeats at least, to be said
};

/// Of one kind of measurement: what the last one of each sensor held, and where the odometry was
/// then.
class Repeats {
 public:
  explicit Repeats(const RepeatOptions& options = {}) : options_(options) {}

  /// `sensor`, `content`: hashes of its place on the body and of the measurement (content_hash);
  /// `T_odom_body`: nullopt before the first odometry. Whether the content is that of this sensor's
  /// measurement before, though the odometry moved since: no sensor's noise gives that.
  bool add(Timestamp stamp, std::uint64_t sensor, std::uint64_t content,
           const std::optional<SE3>& T_odom_body);
  /// "12 of 300 scans ..., first at T"; nullopt where fewer than `few` are.
  std::optional<Warning> warning(const std::string& id, const std::string& what) const;

 private:
  struct Last {
    std::uint64_t content = 0;
    std::optional<SE3> T_odom_body;  ///< where this content came first
  };
  RepeatOptions options_;
  std::map<std::uint64_t, Last> last_;  ///< by sensor
  std::optional<Timestamp> first_;
  std::int64_t all_ = 0, repeated_ = 0;
  double farthest_ = 0;  ///< m, moved under one content
};

/// The source's measurements; scans and images that repeat the one before though the robot moved
/// are without returns: no evidence of what is there now. Warnings "scans_repeat" and
/// "images_repeat". Without odometry nothing tells a robot that stands from a camera that hangs.
class UnrepeatedRecording final : public ForwardingRecording {
 public:
  explicit UnrepeatedRecording(std::unique_ptr<Recording> source)
      : ForwardingRecording(std::move(source)) {}

  std::optional<Measurement> next() override { return checked(source().next()); }
  std::optional<Measurement> next_light() override { return checked(source().next_light()); }
  std::vector<Warning> warnings() const override;

 private:
  std::optional<Measurement> checked(std::optional<Measurement> measurement);

  std::optional<SE3> T_odom_body_;
  Repeats scans_, images_;
};

}  // namespace lamina
