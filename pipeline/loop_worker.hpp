// Loops are closed beside the front-end, in a thread of their own.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include <lamina/pipeline/closed_step.hpp>

namespace lamina {

/// Gives each step to the loop closer and hands it back with the loops that its scan closed, in the
/// order of the steps: when that is done changes, never what it is. The closer must be left alone
/// but after drain() or stop().
class LoopWorker {
 public:
  /// `beside`: in a thread; otherwise add() closes its step's loops before it returns. `closer`
  /// null: steps come back as they are.
  LoopWorker(LoopCloser* closer, bool beside);
  ~LoopWorker();
  LoopWorker(const LoopWorker&) = delete;
  LoopWorker& operator=(const LoopWorker&) = delete;

  /// Waits while kAhead steps are ahead of the closer.
  void add(Step&& step);
  /// What is done by now; throws what the closer threw.
  std::vector<ClosedStep> ready();
  /// Waits for all that were added.
  std::vector<ClosedStep> drain();
  /// Ends the thread; what it has not begun is left.
  void stop();

 private:
  static constexpr std::size_t kAhead = 64;
  void run();
  std::vector<ClosedStep> take_done();

  LoopCloser* closer_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Step> waiting_;
  std::vector<ClosedStep> done_;
  bool busy_ = false, stopped_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // none: not beside
};

}  // namespace lamina
