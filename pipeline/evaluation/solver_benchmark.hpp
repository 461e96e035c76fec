// The solver alone on a benchmark problem (FILE.planegraph).
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include <lamina/backend/solver/engine.hpp>

namespace lamina {

struct SolvedBenchmark {
  std::string summary;  ///< a line of figures
  bool converged = false;
};

/// Solves the whole graph, or the fixed-lag window of so many keyframes over it, and writes
/// trajectory.txt (the pose index as time), metrics.json and, of the whole graph, graph.g2o.
/// `ended` true: the iterations end, what stands is written. Throws lamina::Error for files that
/// cannot be read or written.
SolvedBenchmark solve_benchmark(const std::filesystem::path& file,
                                const std::filesystem::path& output, std::optional<int> window,
                                SolverEngine engine, const std::function<bool()>& ended);

}  // namespace lamina
