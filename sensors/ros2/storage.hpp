// Files that hold messages as bytes, by topic and in order of their recording.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace lamina::ros2 {

/// Text of a file as it may stand in one line: control characters become '?'.
inline std::string printable(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = '?';
  }
  return text;
}

struct StoredTopic {
  std::string name;
  std::string type;      ///< as the file has it, "sensor_msgs/msg/LaserScan"
  std::string encoding;  ///< of its messages, "cdr"
  std::string qos;       ///< offered_qos_profiles as YAML; "" where the file has none
  std::int64_t count = 0;
};

struct StoredMessage {
  std::size_t topic = 0;    ///< index into topics()
  std::int64_t log_ns = 0;  ///< when it was recorded
  std::string_view bytes;   ///< until the next call
};

class Storage {
 public:
  Storage() = default;
  Storage(const Storage&) = delete;
  Storage& operator=(const Storage&) = delete;
  virtual ~Storage() = default;

  virtual const std::vector<StoredTopic>& topics() const = 0;
  /// Starts over with the topics for which `wanted` is true.
  virtual void select(const std::vector<bool>& wanted) = 0;
  /// False at the end.
  virtual bool next(StoredMessage& message) = 0;
  /// What of the file could not be read, one line each.
  virtual std::vector<std::string> problems() const = 0;
};

}  // namespace lamina::ros2
