// Messages of ROS bags as plain structs: what ROS 1 and ROS 2 files are both turned into. No ROS
// types, and C++17 (Debian's message headers of ROS 1 end there).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lamina::bag {

/// Translation (m) and quaternion x y z w.
using PlainPose = std::array<double, 7>;

enum : std::int64_t { kSecond = 1000000000 };  // ns

/// kOther: a type that nothing is read of but its time.
enum class Kind { kScan, kDepth, kCloud, kOdometry, kCameraInfo, kTransform, kImu, kOther };

/// One message, flattened; which fields count depends on the kind.
struct Message {
  Kind kind = Kind::kOther;
  std::string topic, frame, child_frame;
  std::int64_t stamp_ns = 0;
  // kScan
  float angle_min = 0, angle_increment = 0, range_min = 0, range_max = 0, time_increment = 0;
  std::vector<float> ranges;
  // kDepth, kCameraInfo, kCloud
  int width = 0, height = 0;
  std::string encoding;                ///< of an image, also of one that is no depth
  bool metres = false;                 ///< kDepth: from 32FC1, already turned to millimetres
  bool floats_in_mm = false;           ///< kDepth: that held millimetres before
  std::vector<std::uint16_t> depth;    ///< millimetres
  std::array<double, 4> intrinsics{};  ///< fx fy cx cy
  std::vector<double> distortion;
  std::string distortion_model;
  std::vector<std::array<float, 3>> points;  ///< kCloud: x y z in `frame`, m; width * height
  // kOdometry, kTransform: pose of child_frame in frame
  PlainPose pose{};
  // kImu
  std::array<double, 3> acceleration{};
};

/// A topic of the bag and what its messages are.
struct Topic {
  std::string name;
  std::string type;  ///< as ROS 1 has it, "sensor_msgs/LaserScan", also of ROS 2 bags
  std::int64_t count = 0;
  std::string unread;  ///< why its messages cannot be read ("" where they can)
};

/// Gives a bag's messages in the order in which they were received.
class Source {
 public:
  Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;
  virtual ~Source() = default;

  virtual std::vector<Topic> topics() const = 0;
  /// Starts over with these topics only.
  virtual void select(const std::vector<std::string>& topics) = 0;
  enum class Status { kMessage, kDamaged, kWrongFormat, kEnd };
  /// The next message; where it is damaged or of a format that is not read, `message` has topic,
  /// frame and stamp as far as they are known. A tf message with several transforms comes as
  /// several messages.
  virtual Status next(Message& message) = 0;
  /// What was odd about the file itself, for people: cut short, parts that are missing. Complete
  /// once all was read.
  virtual std::vector<std::string> problems() const { return {}; }
};

}  // namespace lamina::bag
