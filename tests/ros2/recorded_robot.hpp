// A recording's messages, played as a robot publishes them.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/ros2/cdr_writer.hpp>

#include "ros2/fast_robot.hpp"

namespace lamina::test {

using Clock = std::chrono::steady_clock;

class RecordedRobot {
 public:
  RecordedRobot(const std::filesystem::path& bag, int domain) : robot_(domain) {
    const auto source = open_ros2_messages(bag);
    std::vector<std::string> topics;
    for (const bag::Topic& topic : source->topics()) topics.push_back(topic.name);
    source->select(topics);
    bag::Message message;
    while (source->next(message) == bag::Source::Status::kMessage) {
      const ros2::CdrMessage coded = ros2::encode(message);
      messages_.push_back({message.topic, coded.bytes, message.stamp_ns});
      if (!types_.emplace(message.topic, coded.type).second) continue;
      const bool fixed = message.topic == "/tf_static";
      const bool sensor = message.kind == bag::Kind::kScan || message.kind == bag::Kind::kImu;
      robot_.advertise(message.topic, coded.type, {!sensor, fixed, 100});
    }
  }

  /// Waits until the topics that are mapped have a subscriber; false after ten seconds.
  bool await_subscribers() const {
    const auto ready = [this] {
      return robot_.subscribers("/scan") > 0 && robot_.subscribers("/odom") > 0 &&
             robot_.subscribers("/camera/depth/image_raw") > 0 &&
             robot_.subscribers("/tf_static") > 0;
    };
    for (int i = 0; i < 1000 && !ready(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));  // they have to find us, too
    return ready();
  }

  /// Publishes all of it at `rate` times the time it was recorded in; true once it is through,
  /// false where `ended` says so before.
  bool play(double rate, const std::function<bool()>& ended) {
    const auto begin = Clock::now();
    for (const Message& message : messages_) {
      const std::chrono::duration<double> after(
          1e-9 * static_cast<double>(message.stamp_ns - messages_.front().stamp_ns) / rate);
      while (Clock::now() < begin + after) {
        if (ended()) return false;
        std::this_thread::sleep_for(std::min<Clock::duration>(
            std::chrono::milliseconds(20),
            std::chrono::duration_cast<Clock::duration>(begin + after - Clock::now())));
      }
      if (message.topic == "/scan") sent_[message.stamp_ns] = Clock::now();
      robot_.publish(message.topic, message.bytes);
      frames_ += message.topic == "/scan" || message.topic == "/camera/depth/image_raw";
    }
    std::this_thread::sleep_for(std::chrono::seconds(1));  // images leave by a thread
    return true;
  }

  FastRobot& node() { return robot_; }
  /// Scans and images that were published.
  std::int64_t frames() const { return frames_; }
  /// When each scan was published, by its stamp (ns).
  const std::map<std::int64_t, Clock::time_point>& sent() const { return sent_; }

 private:
  struct Message {
    std::string topic, bytes;
    std::int64_t stamp_ns = 0;
  };
  FastRobot robot_;
  std::vector<Message> messages_;
  std::map<std::string, std::string> types_;
  std::int64_t frames_ = 0;
  std::map<std::int64_t, Clock::time_point> sent_;
};

}  // namespace lamina::test
