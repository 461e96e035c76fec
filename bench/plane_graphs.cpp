// Solves .planegraph files and prints iterations, time, accuracy.
//
//   bench_plane_graphs [--repeat N] [--robust] FILE...
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include <lamina/backend/plane_graph_solve.hpp>
#include <lamina/models/error.hpp>

namespace {

void run(const std::string& file, int repeat, const lamina::RefineOptions& options, bool verbose) {
  const lamina::PlaneGraph problem = lamina::read_plane_graph(file);
  std::vector<double> times;
  lamina::PlaneGraphResult result;
  for (int i = 0; i < repeat; ++i) {
    result = lamina::solve_plane_graph(problem, options, [&](const lamina::RefineProgress& p) {
      if (verbose && i == 0) {
        std::printf("  round %d iteration %d cost %.6g predicted %.3g\n", p.round, p.iteration,
                    p.cost, p.predicted_decrease);
      }
      return true;
    });
    times.push_back(result.refine.solve_s);
  }
  std::sort(times.begin(), times.end());
  std::printf("%-44s %-10s %3d it  min %.4f s  median %.4f s  ate %.4f m  planes %.3f deg",
              file.substr(file.find_last_of('/') + 1).c_str(), to_string(result.refine.status),
              result.refine.iterations, times.front(), times[times.size() / 2], result.ate_m,
              result.plane_angle_deg);
  std::printf("  rejected %zu  rank deficiency %d\n", result.refine.rejected.size(),
              result.refine.rank_deficiency);
}

}  // namespace

int main(int argc, char** argv) {
  int repeat = 1;
  bool verbose = false;
  lamina::RefineOptions options;
  options.robust = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--repeat") == 0 && i + 1 < argc) {
      repeat = std::max(1, std::atoi(argv[++i]));
    } else if (std::strcmp(argv[i], "--robust") == 0) {
      options.robust = true;
    } else if (std::strcmp(argv[i], "--from-evidence") == 0) {
      options.planes_from_evidence = true;
    } else if (std::strcmp(argv[i], "--verbose") == 0) {
      verbose = true;
    } else {
      try {
        run(argv[i], repeat, options, verbose);
      } catch (const lamina::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
      }
    }
  }
  return 0;
}
