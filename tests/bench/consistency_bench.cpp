// Is the estimator as sure as it may be? Monte Carlo runs over generated buildings whose noise is
// exactly what the factors state: normalised estimation error squared (NEES) of window and refiner,
// and the window's path beside the batch's where there is no loop.
//
//   consistency_bench [RUNS] [--engine native|ceres]     default 100, native
//   consistency_bench RUNS --redraw FILE.planegraph [--engine ...]
//
// --redraw: the window over the file's building and path, RUNS draws of its noise; the newest pose
// by laps, before and after the window comes to where it was.
//
// The bounds printed are those of 95 % for the mean of independent runs: of a run's samples the
// mean is taken first, because its poses share their drift.
#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <lamina/backend/solver/covariance.hpp>
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>
#include <lamina/pipeline/evaluation/window_plane_graph.hpp>

#include "backend/mapper/room_generator.hpp"

namespace {

using namespace lamina;

constexpr std::size_t kSamples = 40;  // poses of each run

struct Arguments {
  std::uint64_t runs = 100;
  SolverEngine engine = SolverEngine::kNative;
  std::string redraw;       // a file
  int dormant_planes = -1;  // of the window; -1: its default
};

Arguments read(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const std::string next = i + 1 < argc ? argv[i + 1] : "";
    if (word == "--engine") {
      a.engine = next == "ceres" ? SolverEngine::kCeres : SolverEngine::kNative;
    } else if (word == "--redraw") {
      a.redraw = next;
    } else if (word == "--dormant") {
      a.dormant_planes = std::atoi(next.c_str());
    } else {
      a.runs = std::max(1ull, std::strtoull(word.c_str(), nullptr, 10));
      continue;
    }
    ++i;
  }
  return a;
}

/// Means of runs, and how far their mean may be off.
class Table {
 public:
  void add(double mean_of_run) { runs_.push_back(mean_of_run); }
  void print(const char* name, double expected, const char* aim) const {
    double sum = 0, squares = 0;
    const auto n = static_cast<double>(runs_.size());
    for (const double x : runs_) sum += x;
    const double mean = sum / n;
    for (const double x : runs_) squares += (x - mean) * (x - mean);
    const double error = 1.96 * std::sqrt(squares / std::max(1.0, n - 1) / n);
    std::printf("%-52s %7.3f +- %.3f  (right: %g; %s)\n", name, mean, error, expected, aim);
  }

 private:
  std::vector<double> runs_;
};

double nees(const SE3& estimate, const SE3& truth, const Matrix6d& covariance) {
  const Vector6d e = (estimate.inverse() * truth).log();
  return e.dot(covariance.ldlt().solve(e));
}

double nees(const Plane& estimate_anchor, const Plane& truth_map, const Eigen::Vector3d& anchor,
            const Eigen::Matrix3d& covariance) {
  const Eigen::Vector3d e = truth_map.about(anchor).boxminus(estimate_anchor);
  return e.dot(covariance.ldlt().solve(e));
}

struct Window {
  Table poses, planes;

  void add(const PlaneGraph& problem, const WindowOptions& options) {
    const WindowRun run = run_window_on_plane_graph(problem, options, true);
    const std::size_t n = run.newest_covariance.size();
    double sum = 0;
    for (std::size_t k = 1; k <= kSamples; ++k) {
      const std::size_t i = k * (n - 1) / kSamples;
      sum += nees(run.T_map_newest[i], problem.truth_map_body[i], run.newest_covariance[i]);
    }
    poses.add(sum / static_cast<double>(kSamples));
    sum = 0;
    int count = 0;
    for (const auto& d : run.departed) {
      const Plane& truth = problem.truth_planes[static_cast<std::size_t>(d.plane)];
      // Some views tell next to nothing of a tilt: beyond a few degrees nothing is linear.
      if (!(d.covariance.topLeftCorner<2, 2>().trace() < 0.01)) continue;
      sum += nees(d.plane_anchor, truth, d.anchor_map, d.covariance);
      ++count;
    }
    if (count > 0) planes.add(sum / count);
  }
};

/// Floor cells carried by every eleventh keyframe, seen by the next two as well.
struct Floor {
  std::vector<Eigen::Vector3d> truth;  ///< states
};

Floor add_surfels(Graph& graph, const PlaneGraph& problem, std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  Floor floor;
  const double sigma = problem.sigma_point, radius = 0.3;
  for (std::size_t i = 2; i + 2 < graph.keyframes.size(); i += 11) {
    const SE3& T = problem.truth_map_body[i];
    const Plane floor_body = T.inverse() * Plane(Eigen::Vector3d::UnitZ(), 0);
    const Eigen::Vector3d at = floor_body.project(Eigen::Vector3d(1, 0.2, 0));
    SurfelLandmark surfel;
    surfel.anchor = graph.keyframes[i].id;
    // The cell's frame is as upright as the carrier's first guess is.
    surfel.T_body_cell =
        SE3(SO3(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), floor_body.normal())) *
                SO3::exp({0.01 * normal(engine), 0.01 * normal(engine), 0}),
            at);
    surfel.radius = radius;
    const SurfelId id = graph.add_surfel(surfel);
    const Plane cell = surfel.T_body_cell.inverse() * floor_body;
    const Eigen::Vector3d& n = cell.normal();
    floor.truth.emplace_back(cell.rho() / n.z(), -n.x() / n.z(), -n.y() / n.z());
    for (std::size_t k = i; k <= i + 2; ++k) {
      Moments seen;
      for (int p = 0; p < 30; ++p) {
        Eigen::Vector3d x = T * at;
        x += Eigen::Vector3d(radius * uniform(engine), radius * uniform(engine), 0);
        x.z() = sigma * normal(engine);
        seen.add(problem.truth_map_body[k].inverse() * x, 1 / (sigma * sigma));
      }
      const auto fit = seen.fit_plane(Eigen::Vector3d::Zero(), 1.0);
      if (!fit) continue;
      graph.surfel_moments.push_back(
          {graph.keyframes[k].id, id, seen.discounted(fit->plane.normal(), NoiseFloor())});
    }
  }
  return floor;
}

struct Batch {
  Table poses, joint, planes, surfels;

  void add(const PlaneGraph& problem, std::uint64_t seed, SolverEngine solver) {
    Graph graph = make_graph(problem);
    std::mt19937_64 engine(seed);
    const Floor floor = add_surfels(graph, problem, engine);
    RefineOptions options;
    options.engine = solver;
    const RefineResult result = refine(graph, options);
    if (result.status != SolveStatus::kConverged) std::puts("a batch did not converge");
    CovarianceRequest request;
    request.joint_keyframes = true;
    std::vector<std::size_t> index;
    for (std::size_t k = 1; k <= kSamples; ++k) {
      index.push_back(k * (graph.keyframes.size() - 1) / kSamples);
      request.keyframes.push_back(graph.keyframes[index.back()].id);
    }
    for (const auto& p : graph.planes) {
      if (p.active) request.planes.push_back(p.id);
    }
    for (const auto& s : graph.surfels) request.surfels.push_back(s.id);
    const Covariances found = covariances(graph, request);
    Eigen::VectorXd error(static_cast<Eigen::Index>(6 * kSamples));
    double sum = 0;
    for (std::size_t k = 0; k < kSamples; ++k) {
      const SE3& estimate = graph.keyframes[index[k]].T_map_body;
      const SE3& truth = problem.truth_map_body[index[k]];
      error.segment<6>(static_cast<Eigen::Index>(6 * k)) = (estimate.inverse() * truth).log();
      sum += nees(estimate, truth, found.keyframes[k]);
    }
    poses.add(sum / static_cast<double>(kSamples));
    joint.add(error.dot(found.joint_keyframes.ldlt().solve(error)) /
              static_cast<double>(error.size()));
    sum = 0;
    for (std::size_t k = 0; k < request.planes.size(); ++k) {
      const PlaneLandmark& plane = graph.at(request.planes[k]);
      sum += nees(plane.plane_anchor, problem.truth_planes[static_cast<std::size_t>(plane.id)],
                  plane.anchor_map, found.planes[k]);
    }
    planes.add(sum / static_cast<double>(request.planes.size()));
    sum = 0;
    for (std::size_t k = 0; k < request.surfels.size(); ++k) {
      const Eigen::Vector3d e = floor.truth[k] - graph.surfels[k].state;
      sum += e.dot(found.surfels[k].ldlt().solve(e));
    }
    surfels.add(sum / static_cast<double>(request.surfels.size()));
  }
};

double ate(const std::vector<SE3>& estimate, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    sum += (estimate[i].translation() - truth[i].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

void consistency(std::uint64_t runs, SolverEngine engine) {
  Window without, with;
  Batch batch;
  WindowOptions forget, remember;
  forget.engine = remember.engine = engine;
  forget.return_inflation = 1e6;  // what left is as good as unknown
  forget.planes_behind = 0;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const PlaneGraph problem = test::make_rooms({.seed = seed});
    without.add(problem, forget);
    with.add(problem, remember);
    batch.add(problem, seed, engine);
  }
  std::printf("%d runs x %zu samples, 198 poses in two laps of nine rooms, engine %s\n",
              static_cast<int>(runs), kSamples, to_string(engine));
  without.poses.print("window, newest pose, nothing returns", 6, "aim 5.5 to 6.5");
  without.planes.print("window, planes as they leave, nothing returns", 3, "aim 2.75 to 3.25");
  with.poses.print("window, newest pose, second lap meets the first", 6, "aim 5.5 to 6.5");
  with.planes.print("window, planes as they leave, likewise", 3, "aim 2.75 to 3.25");
  batch.poses.print("refiner, each pose", 6, "aim 5.5 to 6.5");
  batch.joint.print("refiner, all sampled poses at once, over dof", 1, "aim 0.95 to 1.05");
  batch.planes.print("refiner, each plane", 3, "aim 2.85 to 3.15");
  batch.surfels.print("refiner, each surfel", 3, "aim 2.85 to 3.15");
}

/// NEES of the newest pose in each of `parts` equal parts of the path, run by run.
void redraw(const Arguments& arguments) {
  constexpr std::size_t kParts = 8;
  const PlaneGraph file = read_plane_graph(arguments.redraw);
  WindowOptions options;
  options.engine = arguments.engine;
  if (arguments.dormant_planes >= 0) options.planes_behind = arguments.dormant_planes;
  std::array<Table, kParts> parts;
  Table all, second;
  for (std::uint64_t seed = 1; seed <= arguments.runs; ++seed) {
    const PlaneGraph problem = test::redrawn(file, seed);
    const WindowRun run = run_window_on_plane_graph(problem, options, true);
    const std::size_t n = run.newest_covariance.size();
    std::array<double, kParts> sums{};
    std::array<int, kParts> counts{};
    for (std::size_t i = 1; i < n; ++i) {
      const std::size_t part = i * kParts / n;
      sums[part] += nees(run.T_map_newest[i], problem.truth_map_body[i], run.newest_covariance[i]);
      ++counts[part];
    }
    double first_half = 0, second_half = 0;
    for (std::size_t k = 0; k < kParts; ++k) {
      const double mean = sums[k] / counts[k];
      parts[k].add(mean);
      (k < kParts / 2 ? first_half : second_half) += mean * 2 / kParts;
    }
    all.add((first_half + second_half) / 2);
    second.add(second_half);
  }
  std::printf("%s, %d draws of its noise, window by %s, %d dormant planes: newest pose\n",
              arguments.redraw.c_str(), static_cast<int>(arguments.runs),
              to_string(arguments.engine), options.planes_behind);
  for (std::size_t k = 0; k < kParts; ++k) {
    parts[k].print(("part " + std::to_string(k + 1) + " of " + std::to_string(kParts)).c_str(), 6,
                   k < kParts / 2 ? "first lap" : "second lap");
  }
  second.print("second lap", 6, "aim 5 to 7");
  all.print("all", 6, "aim 5 to 7");
}

void lag_against_batch(std::uint64_t runs) {
  double window = 0, batch = 0, dead_reckoning = 0;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const PlaneGraph problem = test::make_rooms({.rooms = 18, .laps = 1, .seed = seed});
    window += ate(run_window_on_plane_graph(problem, {}).T_map_body, problem.truth_map_body);
    batch += solve_plane_graph(problem).ate_m;
    dead_reckoning += ate(problem.initial_map_body, problem.truth_map_body);
  }
  const auto n = static_cast<double>(runs);
  std::printf(
      "no loop, 18 rooms in one lap, %d runs: ATE window %.4f m, batch %.4f m, ratio %.3f (aim "
      "1.1);"
      " dead reckoning %.3f m\n",
      static_cast<int>(runs), window / n, batch / n, window / batch, dead_reckoning / n);
}

PlaneGraph first_poses(PlaneGraph problem, std::size_t count) {
  const auto end = static_cast<int>(count);
  problem.truth_map_body.resize(count);
  problem.initial_map_body.resize(count);
  std::erase_if(problem.odometry, [&](const auto& o) { return std::max(o.from, o.to) >= end; });
  std::erase_if(problem.observations, [&](const auto& o) { return o.pose >= end; });
  return problem;
}

/// What no estimator of this lag can better: each pose from a batch over all up to `lag` poses
/// later.
double ate_of_best_lag(const PlaneGraph& problem, std::size_t lag) {
  std::vector<SE3> estimate;
  const std::size_t n = problem.truth_map_body.size();
  for (std::size_t t = 0; t < n; ++t) {
    const Graph graph = solve_plane_graph(first_poses(problem, std::min(n, t + lag))).graph;
    estimate.push_back(graph.keyframes[t].T_map_body);
  }
  return ate(estimate, problem.truth_map_body);
}

void lag_where_nothing_returns(std::uint64_t runs) {
  double window = 0, best = 0, batch = 0;
  WindowOptions forget;
  forget.return_inflation = 1e6;
  forget.planes_behind = 0;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const PlaneGraph all = test::make_rooms({.seed = seed});
    const PlaneGraph problem = test::without_returns(all, forget.keyframes + forget.idle_keyframes);
    window += ate(run_window_on_plane_graph(problem, forget).T_map_body, problem.truth_map_body);
    const auto lag = static_cast<std::size_t>(forget.keyframes);
    best += ate_of_best_lag(problem, lag);
    batch += solve_plane_graph(problem).ate_m;
  }
  const auto n = static_cast<double>(runs);
  std::printf(
      "two laps of nine rooms, planes forgotten as the window does, %d runs: ATE window %.4f m, "
      "best of its lag %.4f m, batch %.4f m; window over batch %.3f (aim 1.1)\n",
      static_cast<int>(runs), window / n, best / n, batch / n, window / batch);
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = read(argc, argv);
  if (!arguments.redraw.empty()) {
    redraw(arguments);
    return 0;
  }
  consistency(arguments.runs, arguments.engine);
  if (arguments.engine != SolverEngine::kNative) return 0;
  lag_against_batch(std::max<std::uint64_t>(1, arguments.runs / 4));
  lag_where_nothing_returns(std::max<std::uint64_t>(1, arguments.runs / 10));
}
