// The window's size over time.
#include <lamina/pipeline/window_log.hpp>

#include <fmt/format.h>

#include <ostream>

#include <lamina/io/atomic_file.hpp>

namespace lamina {

void WindowLog::add(Timestamp stamp, const AddResult& added, const WindowOptions& options) {
  if (!added.is_keyframe || !added.window) return;
  kept_.push_back(stamp);
  entries_.push_back({stamp, kept_.size(), added.window->residuals, added.window_ms});
  const auto too_old = [&] {
    if (kept_.size() <= 3) return false;
    return kept_.size() > static_cast<std::size_t>(options.keyframes) ||
           (options.seconds > 0 && kept_.back() - kept_.front() > options.seconds);
  };
  while (too_old()) kept_.pop_front();
}

void WindowLog::write(const std::filesystem::path& file) const {
  if (entries_.empty()) return;
  io::write_atomically(file, [&](std::ostream& out) {
    out << "timestamp,keyframes,residuals,solve_ms\n";
    for (const Entry& e : entries_) {
      out << fmt::format("{},{},{},{:.3f}\n", e.stamp.to_string(), e.keyframes, e.residuals,
                         e.solve_ms);
    }
  });
}

}  // namespace lamina
