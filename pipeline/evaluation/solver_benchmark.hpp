// The solver alone on a benchmark problem (FILE.planegraph).
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <lamina/backend/solver/window/window_engine.hpp>

namespace lamina {

struct SolvedBenchmark {
  std::string summary;  ///< a line of figures
  bool converged = false;
};

/// Solves the whole graph, or `online` the fixed-lag window over it, by the engine of `options`,
/// and writes trajectory.txt (the pose index as time), metrics.json and, of the whole graph,
/// graph.g2o. `ended` true: the iterations end, what stands is written. Throws lamina::Error for
/// files that cannot be read or written.
SolvedBenchmark solve_benchmark(const std::filesystem::path& file,
                                const std::filesystem::path& output, const WindowOptions& options,
                                bool online, const std::function<bool()>& ended);

}  // namespace lamina
