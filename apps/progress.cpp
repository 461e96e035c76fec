// Draws how far a run has come.
#include <lamina/apps/progress.hpp>

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace lamina::apps {

Progress::Progress(std::optional<std::int64_t> total, bool quiet)
    : total_(total), quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {}

void Progress::update(std::int64_t done, std::int64_t planes) {
  if (quiet_) return;
  const auto now = Clock::now();
  if (std::chrono::duration<double>(now - last_).count() < (terminal_ ? 0.1 : 5.0)) return;
  last_ = now;
  drawn_ = true;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double rate = static_cast<double>(done) / elapsed;
  std::string line = fmt::format("{} measurements, {:.0f}/s, {} planes", done, rate, planes);
  if (total_ && *total_ > 0 && rate > 0) {
    const double share = std::min(1.0, static_cast<double>(done) / static_cast<double>(*total_));
    const auto filled = static_cast<std::size_t>(share * 24);
    line = fmt::format("[{}{}] {:3.0f} % {}, {:.0f} s left", std::string(filled, '#'),
                       std::string(24 - filled, ' '), 100 * share, line,
                       static_cast<double>(*total_ - done) / rate);
  }
  if (terminal_) {
    fmt::print(stderr, "\r\033[K{}", line);
  } else {
    fmt::print(stderr, "{}\n", line);
  }
  std::fflush(stderr);
}

void Progress::finish() {
  if (terminal_ && drawn_) fmt::print(stderr, "\n");
}

}  // namespace lamina::apps
