// Reads a recording ahead of the mapper, in a thread of its own.
#pragma once

#include <deque>
#include <exception>
#include <optional>
#include <thread>

#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/bounded_queue.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// The measurements in the recording's own order: a queue changes when they are read, never which.
/// But where `wait_for_odometry`, the first of it comes before what was measured up to two seconds
/// earlier: the map's frame is the odometry's, and drivers start in any order.
class Reader {
 public:
  Reader(Recording& recording, std::size_t ahead, bool wait_for_odometry = false);
  ~Reader();
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  /// The next measurement; nullopt at the end. Throws what the recording threw, after all that came
  /// before it was handed out.
  std::optional<Measurement> next();
  /// Times of decoding; only after the end or stop().
  const StageTimes& decode_times() const { return times_; }
  /// Ends the thread; the recording may be asked again.
  void stop();

 private:
  void run();
  std::optional<Measurement> next_read();
  void hold_until_odometry();
  Recording& recording_;
  BoundedQueue<Measurement> queue_;
  bool waiting_;
  std::deque<Measurement> held_;  // from the beginning
  StageTimes times_;
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace lamina
