// One thread between two lists of steps.
#include <lamina/pipeline/loop_worker.hpp>

#include <chrono>
#include <utility>

namespace lamina {

ClosedStep close_loops(Step&& step, LoopCloser* closer) {
  ClosedStep closed{std::move(step), {}, {}};
  if (!closer || !closed.step.scan_motion) return closed;
  const auto begin = std::chrono::steady_clock::now();
  closed.loops = closer->add(closed.step.scan.value(), *closed.step.scan_motion);
  closed.closing_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return closed;
}

LoopWorker::LoopWorker(LoopCloser* closer, bool beside) : closer_(closer) {
  if (beside) thread_ = std::thread([this] { run(); });
}

LoopWorker::~LoopWorker() { stop(); }

void LoopWorker::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopped_ || !waiting_.empty(); });
    if (stopped_) return;
    Step step = std::move(waiting_.front());
    waiting_.pop_front();
    busy_ = true;
    lock.unlock();
    ClosedStep closed;
    std::exception_ptr failure;
    try {
      closed = close_loops(std::move(step), closer_);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    busy_ = false;
    if (failure) {
      failure_ = failure;
      stopped_ = true;
    } else {
      done_.push_back(std::move(closed));
    }
    changed_.notify_all();
  }
}

void LoopWorker::add(Step&& step) {
  if (!thread_.joinable()) {
    done_.push_back(close_loops(std::move(step), closer_));
    return;
  }
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return stopped_ || waiting_.size() < kAhead; });
  waiting_.push_back(std::move(step));
  changed_.notify_all();
}

std::vector<ClosedStep> LoopWorker::take_done() {
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  return std::exchange(done_, {});
}

std::vector<ClosedStep> LoopWorker::ready() {
  const std::lock_guard lock(mutex_);
  return take_done();
}

std::vector<ClosedStep> LoopWorker::drain() {
  std::unique_lock lock(mutex_);
  if (thread_.joinable())
    changed_.wait(lock, [this] { return stopped_ || (waiting_.empty() && !busy_); });
  return take_done();
}

void LoopWorker::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

}  // namespace lamina
