// Ctrl-C and SIGTERM: stages end early, what stands is written, a second later the program is gone.
#pragma once

#include <string>

namespace lamina::apps {

/// What a signal does while one of these lives. Every second signal ends the program at once.
class InterruptGuard {
 public:
  enum class Kind {
    /// At once as long as there is nothing to write; then a flag, and the end kGrace later,
    /// whatever
    /// is going on by then: files appear whole or not at all, a checkpoint is good at any instant.
    kWithinASecond,
    /// A flag alone: a live device was ended, and can not be read again.
    kEndsReading,
  };
  /// s from the first signal to the end.
  static constexpr double kGrace = 0.85;

  /// `nothing_written`, `cut_short`: the line on stderr where the program is ended before there was
  /// anything to write, and while it was writing.
  InterruptGuard(Kind kind, const std::string& nothing_written, const std::string& cut_short);
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// From here on there is something to write.
  void something_stands();
  /// All is written: what is left takes no time that matters.
  void all_is_written();
  /// A signal came.
  bool interrupted() const;
  /// s until the end after a signal, infinity before one (or where none ends the program).
  double seconds_left() const;

 private:
  Kind kind_;
};

}  // namespace lamina::apps
