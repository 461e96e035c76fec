// Both solver engines on one graph: costs, states, times.
//
//   engines_bench [--robust] FILE.planegraph | OUTPUT FOLDER OF map ...
//
// Each graph is solved from where it is to a chi-squared tolerance of 1e-9, all factors as they are
// weighted (--robust: doubted, as `refine` does). Printed: the costs' relative difference, the
// largest difference of a keyframe's position and turn and of a plane's distance at its anchor, in
// units of the native engine's covariance too, and CPU seconds of both.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include <lamina/backend/refine/refiner.hpp>
#include <lamina/backend/solver/covariance.hpp>
#include <lamina/io/session.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

namespace {

using namespace lamina;

struct Solved {
  Graph graph;
  RefineResult refined;
  double cost = 0, cpu_s = 0;
};

Solved solve(const Graph& graph, SolverEngine engine, bool robust) {
  Solved solved{graph, {}, 0, 0};
  RefineOptions options;
  options.engine = engine;
  options.robust = robust;
  options.minimizer.max_iterations = 200;
  options.minimizer.chi2_tolerance = 1e-9;
  options.minimizer.relative_tolerance = 1e-14;
  const std::clock_t start = std::clock();
  solved.refined = refine(solved.graph, options);
  solved.cpu_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  for (const CostChange& change : solved.refined.costs) solved.cost += change.after;
  return solved;
}

// Of poses in tangents of `a`'s, by the covariance of each: the most sigmas in any direction.
double most_sigmas(const Graph& a, const Graph& b) {
  CovarianceRequest request;
  const std::size_t step = std::max<std::size_t>(1, a.keyframes.size() / 200);
  for (std::size_t i = 0; i < a.keyframes.size(); i += step) {
    request.keyframes.push_back(a.keyframes[i].id);
  }
  const Covariances known = covariances(a, request);
  double most = 0;
  for (std::size_t i = 0; known.valid && i < request.keyframes.size(); ++i) {
    const Vector6d d =
        (a.at(request.keyframes[i]).T_map_body.inverse() * b.at(request.keyframes[i]).T_map_body)
            .log();
    for (int k = 0; k < 6; ++k) {
      const double variance = known.keyframes[i](k, k);
      if (variance > 0) most = std::max(most, std::abs(d(k)) / std::sqrt(variance));
    }
  }
  return most;
}

void compare(const std::string& name, const Graph& graph, bool robust) {
  const Solved ours = solve(graph, SolverEngine::kNative, robust);
  const Solved theirs = solve(graph, SolverEngine::kCeres, robust);
  double metres = 0, radians = 0, distance = 0;
  for (std::size_t i = 0; i < graph.keyframes.size(); ++i) {
    const SE3 d =
        ours.graph.keyframes[i].T_map_body.inverse() * theirs.graph.keyframes[i].T_map_body;
    metres = std::max(metres, d.translation().norm());
    radians = std::max(radians, d.so3().log().norm());
  }
  for (std::size_t i = 0; i < graph.planes.size(); ++i) {
    if (!graph.planes[i].active) continue;
    distance = std::max(distance, std::abs(ours.graph.planes[i].plane_anchor.rho() -
                                           theirs.graph.planes[i].plane_anchor.rho()));
  }
  std::printf(
      "%-28s %6zu poses %5zu planes  cost %.6g, relative difference %.1e  %.4f mm %.2e rad "
      "planes %.4f mm, %.3f sigma  native %s %d it %.2f s, ceres %s %d it %.2f s\n",
      name.c_str(), graph.keyframes.size(), graph.planes.size(), ours.cost,
      std::abs(ours.cost - theirs.cost) / std::max(1e-12, ours.cost), 1e3 * metres, radians,
      1e3 * distance, most_sigmas(ours.graph, theirs.graph), to_string(ours.refined.status),
      ours.refined.iterations, ours.cpu_s, to_string(theirs.refined.status),
      theirs.refined.iterations, theirs.cpu_s);
  std::fflush(stdout);
}

Graph read(const std::filesystem::path& path) {
  if (path.extension() == ".planegraph") return make_graph(read_plane_graph(path));
  return io::read_session(path / "session.lamina").map.graph;
}

}  // namespace

int main(int argc, char** argv) {
  bool robust = false;
  try {
    for (int i = 1; i < argc; ++i) {
      if (std::strcmp(argv[i], "--robust") == 0) {
        robust = true;
      } else {
        const std::filesystem::path path = argv[i];
        compare(path.filename().string(), read(path), robust);
      }
    }
  } catch (const lamina::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
