// Messages of a running ROS 2 robot as bytes: what a DDS library does for us, without its headers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace lamina::dds {

struct Qos {
  bool reliable = false;         ///< else best effort
  bool transient_local = false;  ///< else volatile: what was sent before is not received
  int depth = 1;                 ///< messages that are kept
};

/// A topic that others publish. Names as ROS 2 has them: "/scan", "sensor_msgs/msg/LaserScan".
struct OfferedTopic {
  std::string name, type;
  Qos qos;  ///< the least that its publishers offer
  int publishers = 0;
};

/// Called in a thread of the library: `cdr` is a message with its four bytes of encapsulation, good
/// until the call ends.
using Received = std::function<void(std::string_view cdr)>;

class Wire {
 public:
  Wire() = default;
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;
  /// No callback runs any more once it is gone.
  virtual ~Wire() = default;

  /// What is offered now, by name; never what this participant publishes itself.
  virtual std::vector<OfferedTopic> topics() = 0;
  /// Receives a topic from here on. One subscription a topic; false where it cannot be made.
  virtual bool subscribe(const OfferedTopic& topic, Received received) = 0;
  virtual void unsubscribe(const std::string& topic) = 0;
  /// Publishers of a subscribed topic that are there now.
  virtual int publishers(const std::string& topic) = 0;
  /// Messages of a subscribed topic that were sent and did not arrive, as far as is known.
  virtual std::int64_t lost(const std::string& topic) = 0;

  /// Opens a topic for write(); false where it cannot be made.
  virtual bool advertise(const std::string& topic, const std::string& type, const Qos& qos) = 0;
  /// A message with its encapsulation, to an advertised topic; false where it could not be sent.
  virtual bool write(const std::string& topic, std::string_view cdr) = 0;
  /// Waits until subscribers have acknowledged what was sent reliably, no longer than `seconds`.
  virtual void flush(double seconds) = 0;
};

/// The highest domain: ports of higher ones are beyond 65535.
enum : int { kLastDomain = 232 };

/// The domain of ROS_DOMAIN_ID, 0 where that is not set. Throws lamina::Error where it is no
/// domain.
int domain_of_environment();

/// Joins a domain through Cyclone DDS; the plug-in is loaded here and not before. On the loopback
/// interface alone unless CYCLONEDDS_URI says otherwise. Throws lamina::Error that says what to
/// install, or what is wrong.
std::unique_ptr<Wire> open_wire(int domain);

/// A plug-in's one function: null and a reason in `error` where it cannot be made.
using MakeWire = Wire* (*)(int domain, std::string* error);
inline constexpr const char* kMakeWire = "lamina_make_wire";

}  // namespace lamina::dds
