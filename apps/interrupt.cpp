// Signals to a flag.
#include <lamina/apps/interrupt.hpp>

#include <csignal>

namespace lamina::apps {
namespace {

volatile std::sig_atomic_t signals_seen = 0;  // a signal handler can reach nothing else

void on_signal(int signal) {
  signals_seen = signals_seen + 1;
  std::signal(signal, SIG_DFL);
}

}  // namespace

InterruptGuard::InterruptGuard() {
  signals_seen = 0;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

InterruptGuard::~InterruptGuard() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool InterruptGuard::interrupted() const { return signals_seen > 0; }

}  // namespace lamina::apps
