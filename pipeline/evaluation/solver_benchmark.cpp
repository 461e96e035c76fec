// Benchmark problems through refiner and window.
#include <lamina/pipeline/evaluation/solver_benchmark.hpp>

#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/graph_files.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/io/metrics.hpp>
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>
#include <lamina/pipeline/evaluation/window_plane_graph.hpp>

namespace lamina {
namespace {

void write_poses(const std::filesystem::path& output, const std::vector<SE3>& poses) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    trajectory.add(Timestamp::from_nanoseconds(static_cast<std::int64_t>(i) * 1'000'000'000),
                   poses[i]);
  }
  io::write_trajectory(output / "trajectory.txt", trajectory);
}

double position_rms(const std::vector<SE3>& poses, const std::vector<SE3>& truth) {
  double squares = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    squares += (poses[i].translation() - truth[i].translation()).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(poses.size()));
}

SolvedBenchmark solve_offline(const PlaneGraph& problem, const std::filesystem::path& output,
                              SolverEngine engine, const std::function<bool()>& ended) {
  RefineOptions options;
  options.engine = engine;
  const PlaneGraphResult result =
      solve_plane_graph(problem, options, [&ended](const RefineProgress&) { return !ended(); });
  std::vector<SE3> poses;
  for (const Keyframe& keyframe : result.graph.keyframes) poses.push_back(keyframe.T_map_body);
  write_poses(output, poses);
  io::write_g2o(output / "graph.g2o", result.graph);
  Diagnostics metrics;
  RefinementFigures refine;
  refine.solve_s = result.refine.solve_s;
  refine.iterations = result.refine.iterations;
  refine.status = to_string(result.refine.status);
  for (const CostChange& cost : result.refine.costs) {
    refine.costs.push_back({cost.name, cost.before, cost.after});
  }
  metrics.refine = refine;
  metrics.counts.rejected_factors = static_cast<double>(result.refine.rejected.size());
  metrics.counts.rank_deficiency = result.refine.rank_deficiency;
  io::write_metrics(output / "metrics.json", metrics);
  std::string summary =
      fmt::format("{} in {} iterations and {:.3f} s", to_string(result.refine.status),
                  result.refine.iterations, result.refine.solve_s);
  if (result.ate_m >= 0)
    summary +=
        fmt::format("; ATE {:.4f} m, planes {:.3f} degrees", result.ate_m, result.plane_angle_deg);
  return {summary, result.refine.status == SolveStatus::kConverged};
}

SolvedBenchmark solve_online(const PlaneGraph& problem, const std::filesystem::path& output,
                             const WindowOptions& options) {
  const WindowRun run = run_window_on_plane_graph(problem, options);
  write_poses(output, run.T_map_body);
  Diagnostics metrics;
  StageTimes& steps = metrics.stages["window"];
  for (const double ms : run.step_ms) steps.add(ms);
  RefinementFigures refine;
  refine.solve_s = 1e-3 * std::accumulate(run.step_ms.begin(), run.step_ms.end(), 0.0);
  refine.iterations = run.iterations;
  refine.status = run.finite ? "converged" : "not finite";
  metrics.refine = refine;
  io::write_metrics(output / "metrics.json", metrics);
  std::string summary = fmt::format(
      "window of {} keyframes: mean {:.3f} ms a pose, p99 {:.3f} ms", options.keyframes,
      1e3 * refine.solve_s / static_cast<double>(run.step_ms.size()), steps.percentile_ms(99));
  if (problem.truth_map_body.size() == run.T_map_body.size())
    summary += fmt::format("; ATE {:.4f} m", position_rms(run.T_map_body, problem.truth_map_body));
  return {summary, run.finite};
}

}  // namespace

SolvedBenchmark solve_benchmark(const std::filesystem::path& file,
                                const std::filesystem::path& output, const WindowOptions& options,
                                bool online, const std::function<bool()>& ended) {
  const PlaneGraph problem = read_plane_graph(file);
  io::make_results_folder(output);
  return online ? solve_online(problem, output, options)
                : solve_offline(problem, output, options.engine, ended);
}

}  // namespace lamina
