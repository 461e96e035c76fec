// The reader thread.
#include <lamina/apps/reader.hpp>

#include <utility>

namespace lamina::apps {

Reader::Reader(Recording& recording, std::size_t ahead)
    : recording_(recording), queue_(ahead), thread_([this] { run(); }) {}

Reader::~Reader() { stop(); }

void Reader::run() {
  try {
    while (true) {
      std::optional<Measurement> measurement;
      {
        const io::Metrics::Timer timer(times_);
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

}  // namespace lamina::apps
