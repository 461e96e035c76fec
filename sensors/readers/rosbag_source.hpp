// ROS 1 bags behind a plain interface: no ROS types, and C++17 (Debian's message headers end
// there).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace lamina::bag {

/// Translation (m) and quaternion x y z w.
using PlainPose = std::array<double, 7>;

enum class Kind { kScan, kDepth, kOdometry, kCameraInfo, kTransform, kImu };

/// One message, flattened; which fields count depends on the kind.
struct Message {
  Kind kind = Kind::kScan;
  std::string topic, frame, child_frame;
  std::int64_t stamp_ns = 0;
  // kScan
  float angle_min = 0, angle_increment = 0, range_min = 0, range_max = 0, time_increment = 0;
  std::vector<float> ranges;
  // kDepth, kCameraInfo
  int width = 0, height = 0;
  bool metres = false;                 ///< kDepth: from 32FC1, already turned to millimetres
  bool floats_in_mm = false;           ///< kDepth: that held millimetres before
  std::vector<std::uint16_t> depth;    ///< millimetres
  std::array<double, 4> intrinsics{};  ///< fx fy cx cy
  std::vector<double> distortion;
  std::string distortion_model;
  // kOdometry, kTransform: pose of child_frame in frame
  PlainPose pose{};
  // kImu
  std::array<double, 3> acceleration{};
};

/// A topic of the bag and what its messages are.
struct Topic {
  std::string name, type;
  std::int64_t count = 0;
};

/// Reads a bag's messages in the order they were received. Throws std::runtime_error with the
/// library's reason when the file is no readable bag.
class Source {
 public:
  explicit Source(const std::string& file);
  ~Source();
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  std::vector<Topic> topics() const;
  /// Starts over with these topics only.
  void select(const std::vector<std::string>& topics);
  enum class Status { kMessage, kDamaged, kWrongFormat, kEnd };
  /// The next message. A tf message with several transforms comes as several messages.
  Status next(Message& message);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lamina::bag
