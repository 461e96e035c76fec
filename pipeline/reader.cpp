// The reader thread.
#include <lamina/pipeline/reader.hpp>

#include <utility>

namespace lamina {

constexpr double kWait = 2;  // s, for the first odometry

Reader::Reader(Recording& recording, std::size_t ahead, bool wait_for_odometry)
    : recording_(recording),
      queue_(ahead),
      waiting_(wait_for_odometry),
      thread_([this] { run(); }) {}

Reader::~Reader() { stop(); }

void Reader::run() {
  try {
    while (true) {
      std::optional<Measurement> measurement;
      {
        const Diagnostics::Timer timer(times_);
        measurement = recording_.next();
      }
      if (!measurement || !queue_.push(std::move(*measurement))) break;
    }
  } catch (...) {
    failure_ = std::current_exception();
  }
  queue_.close();
}

std::optional<Measurement> Reader::next() {
  if (std::exchange(waiting_, false)) hold_until_odometry();
  if (held_.empty()) return next_read();
  std::optional<Measurement> measurement = std::move(held_.front());
  held_.pop_front();
  return measurement;
}

void Reader::hold_until_odometry() {
  try {
    while (auto measurement = next_read()) {
      if (std::holds_alternative<Odometry>(*measurement)) {
        held_.push_front(std::move(*measurement));
        return;
      }
      held_.push_back(std::move(*measurement));
      if (stamp_of(held_.back()) - stamp_of(held_.front()) > kWait) return;
    }
  } catch (...) {
    failure_ = std::current_exception();  // after what came before it
  }
}

std::optional<Measurement> Reader::next_read() {
  std::optional<Measurement> measurement = queue_.pop();
  if (!measurement) {
    stop();
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  }
  return measurement;
}

void Reader::stop() {
  queue_.close();
  if (thread_.joinable()) thread_.join();
}

}  // namespace lamina
