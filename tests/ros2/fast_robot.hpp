// A ROS 2 node of another vendor, for tests: Fast DDS on the loopback interface, messages as bytes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace lamina::test {

struct RobotQos {
  bool reliable = true, transient_local = false;
  int depth = 10;
};

class FastRobot {
 public:
  explicit FastRobot(int domain);
  ~FastRobot();
  FastRobot(const FastRobot&) = delete;
  FastRobot& operator=(const FastRobot&) = delete;

  /// Names as ROS 2 has them; bytes with their encapsulation.
  void advertise(const std::string& topic, const std::string& type, const RobotQos& qos);
  void publish(const std::string& topic, const std::string& cdr);
  /// Subscribers of an advertised topic.
  int subscribers(const std::string& topic) const;
  /// Called in a thread of the library.
  void subscribe(const std::string& topic, const std::string& type, const RobotQos& qos,
                 std::function<void(const std::string& cdr)> received);

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace lamina::test
