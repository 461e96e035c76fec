// The window on benchmark problems: accuracy and consistency.
#include <lamina/pipeline/evaluation/window_plane_graph.hpp>

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <numeric>

#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

#include "backend/mapper/room_generator.hpp"

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

// The same building, path and views with noise drawn anew from the stated model.
PlaneGraph renoised(const PlaneGraph& original, unsigned seed) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  PlaneGraph p = original;
  for (auto& o : p.odometry) {
    Vector6d e;
    for (int k = 0; k < 6; ++k) {
      e(k) = normal(rng) * (k < 3 ? p.sigma_translation : p.sigma_rotation);
    }
    o.T_from_to = p.truth_map_body[static_cast<std::size_t>(o.from)].inverse() *
                  p.truth_map_body[static_cast<std::size_t>(o.to)] * SE3::exp(e);
  }
  for (std::size_t i = 1; i < p.initial_map_body.size(); ++i) {
    p.initial_map_body[i] = p.truth_map_body[i];  // overwritten by chained odometry in the run
  }
  p.initial_map_body[0] = p.truth_map_body[0];
  for (auto& o : p.observations) {
    const SE3& T = p.truth_map_body[static_cast<std::size_t>(o.pose)];
    const Plane truth = T.inverse() * p.truth_planes[static_cast<std::size_t>(o.plane)];
    const Moments& m = o.moments_body;
    const Matrix32d B = truth.tangent_basis();
    const Eigen::Matrix2d S = B.transpose() * m.scatter() * B;
    const Eigen::Vector3d c = truth.project(m.mean());
    const Eigen::LLT<Eigen::Matrix2d> llt(S);
    const Eigen::Vector2d tilt =
        p.sigma_point * llt.matrixU().solve(Eigen::Vector2d(normal(rng), normal(rng)));
    const double rho = p.sigma_point / std::sqrt(m.weight()) * normal(rng);
    const Plane seen = truth.about(c).boxplus({tilt.x(), tilt.y(), rho});
    // In-plane directions carried along with the tilt.
    const SO3 turn = SO3::exp(truth.normal().cross(B * tilt));
    const Matrix32d Bs = turn.matrix() * B;
    o.moments_body =
        Moments(m.weight(), c + rho * seen.normal(), Bs * S * Bs.transpose(), m.count());
  }
  return p;
}

double mean_nees(const WindowRun& run, const PlaneGraph& problem, std::size_t every) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 5; i < run.newest_covariance.size(); i += every, ++count) {
    const Vector6d e = (run.T_map_newest[i].inverse() * problem.truth_map_body[i]).log();
    sum += e.dot(run.newest_covariance[i].inverse() * e);
  }
  return sum / count;
}

TEST(WindowOnPlaneGraph, IsAsSureAsItMayBe) {
  const auto file = data_folder() / "plane_graphs" / "rooms_198.planegraph";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file;
  const PlaneGraph original = read_plane_graph(file);
  WindowOptions options;
  options.return_inflation = 1e6;  // no loops
  options.planes_behind = 0;
  double nees = 0, window_ate = 0, batch_ate = 0;
  const int runs = 24, compared = 6;
  for (unsigned seed = 1; seed <= runs; ++seed) {
    const PlaneGraph problem = renoised(original, seed);
    const WindowRun run = run_window_on_plane_graph(problem, options, true);
    ASSERT_TRUE(run.finite) << "seed " << seed;
    nees += mean_nees(run, problem, 5) / runs;
    if (seed > compared) continue;
    window_ate += ate(run.T_map_body, problem.truth_map_body) / compared;
    const int gap = options.keyframes + options.idle_keyframes;
    batch_ate += solve_plane_graph(test::without_returns(problem, gap)).ate_m / compared;
  }
  std::printf("nees %.2f over %d runs; ate %.4f, batch without returns %.4f (%d runs)\n", nees,
              runs, window_ate, batch_ate, compared);
  EXPECT_LT(window_ate, 1.1 * batch_ate);
  EXPECT_GT(nees, 5.5);
  EXPECT_LT(nees, 6.5);
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
