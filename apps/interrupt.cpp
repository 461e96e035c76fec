// Signals to a flag and a timer. Handlers do only what POSIX calls async-signal-safe.
#include <lamina/apps/interrupt.hpp>

#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <limits>

namespace lamina::apps {
namespace {

// A signal handler can reach nothing else.
struct State {
  std::atomic<bool> seen = false, stands = false, written = false, timed = false;
  std::atomic<std::int64_t> end_ns = 0;  // CLOCK_MONOTONIC
  std::array<char, 512> nothing_written{}, cut_short{};
  timer_t timer{};
};
State state;

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{1'000'000'000} * now.tv_sec + now.tv_nsec;
}

[[noreturn]] void end_with(const std::array<char, 512>& line) {
  static_cast<void>(!::write(STDERR_FILENO, line.data(), std::strlen(line.data())));
  ::_exit(1);
}

void on_signal(int) {
  ::signal(SIGINT, SIG_DFL);
  ::signal(SIGTERM, SIG_DFL);
  if (!state.timed) {
    state.seen = true;
    return;
  }
  if (!state.stands) end_with(state.nothing_written);
  constexpr auto kGrace = static_cast<std::int64_t>(1e9 * InterruptGuard::kGrace);
  state.end_ns = now_ns() + kGrace;
  state.seen = true;
  const itimerspec when{{0, 0}, {0, kGrace}};
  ::timer_settime(state.timer, 0, &when, nullptr);
}

void on_end(int) {
  if (state.written) ::_exit(0);
  end_with(state.cut_short);
}

void copy(const std::string& text, std::array<char, 512>& line) {
  line.fill('\0');
  text.copy(line.data(), line.size() - 2);
  line[std::strlen(line.data())] = '\n';
}

}  // namespace

InterruptGuard::InterruptGuard(Kind kind, const std::string& nothing_written,
                               const std::string& cut_short)
    : kind_(kind) {
  state.seen = state.stands = state.written = false;
  copy(nothing_written, state.nothing_written);
  copy(cut_short, state.cut_short);
  state.timed = false;
  if (kind == Kind::kWithinASecond) {
    sigevent event{};
    event.sigev_notify = SIGEV_SIGNAL;
    event.sigev_signo = SIGALRM;
    ::signal(SIGALRM, on_end);
    state.timed = ::timer_create(CLOCK_MONOTONIC, &event, &state.timer) == 0;
  }
  ::signal(SIGINT, on_signal);
  ::signal(SIGTERM, on_signal);
}

InterruptGuard::~InterruptGuard() {
  ::signal(SIGINT, SIG_DFL);
  ::signal(SIGTERM, SIG_DFL);
  if (state.timed) ::timer_delete(state.timer);
  state.timed = false;
  if (kind_ == Kind::kWithinASecond) ::signal(SIGALRM, SIG_DFL);
}

void InterruptGuard::something_stands() { state.stands = true; }

void InterruptGuard::all_is_written() { state.written = true; }

bool InterruptGuard::interrupted() const { return state.seen; }

double InterruptGuard::seconds_left() const {
  if (!state.seen || !state.timed) return std::numeric_limits<double>::infinity();
  return 1e-9 * static_cast<double>(state.end_ns - now_ns());
}

}  // namespace lamina::apps
