// Benchmark problems through refiner and window.
#include <lamina/apps/refine_plane_graph.hpp>

#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include <lamina/apps/interrupt.hpp>
#include <lamina/backend/plane_graph_solve.hpp>
#include <lamina/backend/window_plane_graph.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/graph_files.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/io/metrics.hpp>

namespace lamina::apps {
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

int solve_offline(const PlaneGraph& problem, const std::filesystem::path& output) {
  InterruptGuard interrupt(InterruptGuard::Kind::kWithinASecond, "",
                           "warning: interrupted: there was no time to write the poses");
  interrupt.something_stands();
  const PlaneGraphResult result = solve_plane_graph(
      problem, {}, [&interrupt](const RefineProgress&) { return !interrupt.ending(); });
  std::vector<SE3> poses;
  for (const Keyframe& keyframe : result.graph.keyframes) poses.push_back(keyframe.T_map_body);
  write_poses(output, poses);
  io::write_g2o(output / "graph.g2o", result.graph);
  io::Metrics metrics;
  io::RefineMetrics refine;
  refine.solve_s = result.refine.solve_s;
  refine.iterations = result.refine.iterations;
  refine.status = to_string(result.refine.status);
  for (const CostChange& cost : result.refine.costs) {
    refine.cost_before[to_string(cost.type)] = cost.before;
    refine.cost_after[to_string(cost.type)] = cost.after;
  }
  metrics.refine = refine;
  metrics.counts["rejected_factors"] = static_cast<double>(result.refine.rejected.size());
  metrics.counts["rank_deficiency"] = result.refine.rank_deficiency;
  io::write_metrics(output / "metrics.json", metrics);
  fmt::print("{} in {} iterations and {:.3f} s", to_string(result.refine.status),
             result.refine.iterations, result.refine.solve_s);
  if (result.ate_m >= 0) {
    fmt::print("; ATE {:.4f} m, planes {:.3f} degrees", result.ate_m, result.plane_angle_deg);
  }
  fmt::print("\n");
  return result.refine.status == SolveStatus::kConverged ? 0 : 1;
}

int solve_online(const PlaneGraph& problem, const std::filesystem::path& output, int keyframes) {
  WindowOptions options;
  options.keyframes = keyframes;
  const WindowRun run = run_window_on_plane_graph(problem, options);
  write_poses(output, run.T_map_body);
  io::Metrics metrics;
  io::StageTimes& steps = metrics.stages["window"];
  for (const double ms : run.step_ms) steps.add(ms);
  io::RefineMetrics refine;
  refine.solve_s = 1e-3 * std::accumulate(run.step_ms.begin(), run.step_ms.end(), 0.0);
  refine.iterations = run.iterations;
  refine.status = run.finite ? "converged" : "not finite";
  metrics.refine = refine;
  io::write_metrics(output / "metrics.json", metrics);
  fmt::print("window of {} keyframes: mean {:.3f} ms a pose, p99 {:.3f} ms", keyframes,
             1e3 * refine.solve_s / static_cast<double>(run.step_ms.size()),
             steps.percentile_ms(99));
  if (problem.truth_map_body.size() == run.T_map_body.size()) {
    fmt::print("; ATE {:.4f} m", position_rms(run.T_map_body, problem.truth_map_body));
  }
  fmt::print("\n");
  return run.finite ? 0 : 1;
}

}  // namespace

int refine_plane_graph(const std::filesystem::path& file, const std::filesystem::path& output,
                       bool online, int window_keyframes) {
  const PlaneGraph problem = read_plane_graph(file);
  io::make_results_folder(output);
  return online ? solve_online(problem, output, window_keyframes) : solve_offline(problem, output);
}

}  // namespace lamina::apps
