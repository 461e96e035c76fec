// Ctrl-C: finish the frame and write everything; a second one ends at once.
#pragma once

namespace lamina::apps {

/// While one of these lives, SIGINT and SIGTERM only set a flag; the second signal kills.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  /// True once a signal has come.
  bool interrupted() const;
};

}  // namespace lamina::apps
