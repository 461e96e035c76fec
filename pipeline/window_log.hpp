// How large the sliding window was at each keyframe: window.csv.
#pragma once

#include <deque>
#include <filesystem>
#include <vector>

#include <lamina/backend/mapper/mapper.hpp>

namespace lamina {

class WindowLog {
 public:
  /// Call after each Mapper::add(); only keyframes count. `options` are the mapper's.
  void add(Timestamp stamp, const AddResult& added, const WindowOptions& options);
  /// Lines `timestamp,keyframes,residuals,solve_ms` under a header; no file when there are none.
  void write(const std::filesystem::path& file) const;

 private:
  struct Entry {
    Timestamp stamp;
    std::size_t keyframes = 0;
    int residuals = 0;
    double solve_ms = 0;
  };
  std::deque<Timestamp> kept_;  // as SlidingWindow::marginalize() keeps them
  std::vector<Entry> entries_;
};

}  // namespace lamina
