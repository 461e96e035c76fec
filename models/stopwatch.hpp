// CPU time of the calling thread: what a stage costs, whoever else uses the machine.
#pragma once

#include <ctime>

namespace lamina {

class Stopwatch {
 public:
  Stopwatch() : start_(now()) {}
  double ms() const { return now() - start_; }
  /// Time since the start or the last lap, and starts the next.
  double lap() {
    const double t = now(), spent = t - start_;
    start_ = t;
    return spent;
  }

 private:
  static double now() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  }
  double start_;
};

}  // namespace lamina
