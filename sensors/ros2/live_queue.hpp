// What arrives from a running robot, bounded, in order of stamps.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lamina/sensors/ros2/live_clock.hpp>

namespace lamina::ros2 {

struct LiveQueueOptions {
  std::size_t most = 64;  ///< messages a topic that wait to be mapped; the oldest are dropped
  std::size_t most_small = 20000;  ///< likewise of odometry and transforms, which are taken at once
  std::size_t look_bytes = std::size_t{1} << 29;  ///< of all messages of the first look
  double hold = 0.1;   ///< s that a frame waits for older ones of other topics and for odometry
  double due = 0.95;   ///< of a topic's period after its newest frame, before which none is due,
  double jitters = 4;  ///< less so many times the mean deviation from that period
  double silent = 1;   ///< s after which a topic is not waited for
};

/// How a topic's messages are ordered.
enum class LiveOrder {
  kStamped,   ///< begin with a header: in order of its stamp
  kOdometry,  ///< begin with a header, given as they come; stamped frames wait for them
  kTransforms,
  kDirect,  ///< given as they come
};

struct LiveMessage {
  std::size_t topic = 0;
  std::int64_t stamp = 0;    ///< ns, adjusted; of transforms that of their arrival
  std::int64_t arrival = 0;  ///< ns, steady
  std::string bytes;
};

/// One thread takes, others put. During the first look all messages are kept; take() gives none.
class LiveQueue {
 public:
  explicit LiveQueue(const LiveQueueOptions& options = {}) : options_(options) {}

  /// Returns the topic's number, from 0 on.
  std::size_t add_topic(LiveOrder order);
  void put(std::size_t topic, std::string_view bytes);
  /// Messages of the first look from the k-th on.
  std::vector<LiveMessage> looked(std::size_t k) const;
  /// All of the first look, to which nothing is added any more: what comes from here on waits.
  std::vector<LiveMessage> end_look();
  /// Messages of these topics alone from here on: frames of `look` first, those not wanted are
  /// forgotten.
  void go_live(const std::vector<bool>& wanted, std::vector<LiveMessage> look);
  /// The next message; nullopt where none may go within `seconds`.
  std::optional<LiveMessage> take(double seconds);

  std::vector<std::int64_t> received() const;
  /// Messages that were dropped because the queue of their topic was full.
  std::vector<std::int64_t> dropped() const;
  /// The stamps of a topic's other messages (transforms), on the same time line.
  std::int64_t adjusted(const std::string& stream, std::int64_t stamp);
  LiveClock clock() const;

 private:
  enum class Phase { kLook, kBetween, kLive };
  struct Topic {
    LiveOrder order = LiveOrder::kDirect;
    std::string name;
    bool wanted = true;
    std::deque<LiveMessage> waiting;
    std::size_t least = 0, most = 0;  // that may wait: more while there are those of the look
    std::int64_t newest = 0, arrival = 0, received = 0, dropped = 0;
    double period = 0, jitter = 0;  // ns between stamps: mean, mean deviation from it
  };
  static void note_period(Topic& topic, std::int64_t stamp);
  std::int64_t stamp_of(Topic& topic, std::string_view bytes, std::int64_t now);
  bool may_go(const LiveMessage& message, std::int64_t now) const;
  std::optional<LiveMessage> pop(std::int64_t now);

  LiveQueueOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable news_;
  Phase phase_ = Phase::kLook;
  std::vector<LiveMessage> look_;
  std::size_t look_bytes_ = 0;
  std::vector<Topic> topics_;
  LiveClock clock_;
};

/// The stamp (ns) in a message's header, or of the first transform of a tf message; nullopt where
/// it is zero or the message too short.
std::optional<std::int64_t> header_stamp(std::string_view cdr, bool transforms = false);

}  // namespace lamina::ros2
