// Reads a recording ahead of the mapper, in a thread of its own.
#pragma once

#include <exception>
#include <optional>
#include <thread>

#include <lamina/apps/bounded_queue.hpp>
#include <lamina/io/metrics.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {

/// The measurements in the recording's own order: a queue changes when they are read, never which.
class Reader {
 public:
  Reader(Recording& recording, std::size_t ahead);
  ~Reader();
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  /// The next measurement; nullopt at the end. Throws what the recording threw, after all that came
  /// before it was handed out.
  std::optional<Measurement> next();
  /// Times of decoding; only after the end or stop().
  const io::StageTimes& decode_times() const { return times_; }
  /// Ends the thread; the recording may be asked again.
  void stop();

 private:
  void run();
  Recording& recording_;
  BoundedQueue<Measurement> queue_;
  io::StageTimes times_;
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace lamina::apps
