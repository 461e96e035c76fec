// The window on benchmark problems: accuracy and consistency.
#include <lamina/backend/window_plane_graph.hpp>

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <numeric>

namespace lamina {
namespace {

std::filesystem::path data_folder() {
  const char* set = std::getenv("LAMINA_DATA");
  return set ? std::filesystem::path(set)
             : std::filesystem::path(LAMINA_SOURCE_DIR "/../shared/data");
}

double ate(const std::vector<SE3>& estimate, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    sum += (estimate[i].translation() - truth[i].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

TEST(WindowOnPlaneGraph, BeatsTheFixedLagPeer) {
  const auto file = data_folder() / "plane_graphs" / "rooms_2000.planegraph";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file;
  const PlaneGraph problem = read_plane_graph(file);
  WindowOptions options;
  options.keyframes = 20;
  const WindowRun run = run_window_on_plane_graph(problem, options, true);
  EXPECT_TRUE(run.finite);
  const double error = ate(run.T_map_body, problem.truth_map_body);
  std::vector<double> ms = run.step_ms;
  std::sort(ms.begin(), ms.end());
  double nees = 0;
  for (std::size_t i = 1; i < run.newest_covariance.size(); ++i) {
    const Vector6d e = (run.T_map_newest[i].inverse() * problem.truth_map_body[i]).log();
    nees += e.dot(run.newest_covariance[i].inverse() * e);
  }
  RecordProperty("ate_m", std::to_string(error));
  std::printf("ate %.4f newest %.4f nees %.2f mean ms %.3f p99 %.3f its/pose %.2f\n", error,
              ate(run.T_map_newest, problem.truth_map_body), nees / double(ms.size() - 1),
              std::accumulate(ms.begin(), ms.end(), 0.0) / double(ms.size()),
              ms[ms.size() * 99 / 100], run.iterations / double(ms.size()));
  EXPECT_LE(error, 0.42);
}

}  // namespace
}  // namespace lamina
