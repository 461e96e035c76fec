// Solves .planegraph files and prints iterations, time, accuracy.
//
//   plane_graphs_bench [--repeat N] [--robust] [--verbose] [--wrong SHARE] FILE... [--rooms N]...
//   plane_graphs_bench --from-truth FILE...     starts at the truth: the same minimum?
//   plane_graphs_bench --growth      from 110 to 100,000 keyframes: time, memory, fitted exponents
//   plane_graphs_bench --names SHARE FIRST LAST
//       nine rooms of seeds FIRST to LAST with a share of wrong names: ATE over that with right
//       ones
//
// --rooms N generates N rooms of 22 poses in two laps (909: 20,000 poses; 4546: 100,000). Times are
// of the process's CPU, so that a busy machine does not show in them.
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

#include <lamina/models/error.hpp>
#include <lamina/models/freed_memory.hpp>
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

#include "backend/mapper/room_generator.hpp"

namespace {

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Cost {
  double seconds = 0, peak_mb = 0;
};

Cost run(const std::string& file, const lamina::PlaneGraph& problem, int repeat,
         const lamina::RefineOptions& options, bool verbose) {
  std::vector<double> times;
  lamina::PlaneGraphResult result;
  for (int i = 0; i < repeat; ++i) {
    const double start = cpu_s();
    result = lamina::solve_plane_graph(problem, options, [&](const lamina::RefineProgress& p) {
      if (verbose && i == 0) {
        std::printf("  round %d iteration %d cost %.6g predicted %.3g\n", p.round, p.iteration,
                    p.cost, p.predicted_decrease);
      }
      return true;
    });
    times.push_back(cpu_s() - start);
  }
  std::sort(times.begin(), times.end());
  std::printf("%-44s %-10s %3d it  min %.4f s  median %.4f s  ate %.4f m  planes %.3f deg",
              file.substr(file.find_last_of('/') + 1).c_str(), to_string(result.refine.status),
              result.refine.iterations, times.front(), times[times.size() / 2], result.ate_m,
              result.plane_angle_deg);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const double peak_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  std::printf("  rejected %zu of %zu  weak %d  peak %.0f MB\n", result.refine.rejected.size(),
              problem.observations.size(), result.refine.rank_deficiency, peak_mb);
  return {times.front(), peak_mb};
}

/// Slope of log(cost) over log(keyframes), by least squares.
double exponent(const std::vector<double>& keyframes, const std::vector<double>& costs) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const double a = std::log(keyframes[i]), b = std::log(costs[i]);
    n += 1, x += a, y += b, xx += a * a, xy += a * b;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

void growth(const lamina::RefineOptions& options) {
  std::vector<double> keyframes, seconds, memory;
  for (const int rooms : {5, 46, 455, 909, 4546}) {  // rising: the peak of memory is the process's
    const lamina::PlaneGraph problem = lamina::test::make_rooms({.rooms = rooms});
    const Cost cost = run(std::to_string(problem.initial_map_body.size()) + " keyframes", problem,
                          rooms < 500 ? 5 : 1, options, false);
    keyframes.push_back(static_cast<double>(problem.initial_map_body.size()));
    seconds.push_back(cost.seconds);
    memory.push_back(cost.peak_mb);
  }
  std::printf("growth with the number of keyframes: time ^%.3f, memory ^%.3f (aim: at most 1.2)\n",
              exponent(keyframes, seconds), exponent(keyframes, memory));
}

double ate_of(const lamina::test::RoomOptions& rooms) {
  return lamina::solve_plane_graph(lamina::test::make_rooms(rooms)).ate_m;
}

void wrong_names(double share, int first, int last) {
  double ate = 0, clean = 0, ratios = 0, worst = 0;
  for (int seed = first; seed <= last; ++seed) {
    lamina::test::RoomOptions rooms;
    rooms.seed = static_cast<std::uint64_t>(seed);
    const double right = ate_of(rooms);
    rooms.wrong = share;
    const double wrong = ate_of(rooms);
    ate += wrong;
    clean += right;
    ratios += wrong / right;
    worst = std::max(worst, wrong / right);
  }
  std::printf(
      "%.0f %% wrong names, seeds %d to %d: ATE over clean %.2f in the sum, %.2f in the mean, "
      "%.2f at worst\n",
      100 * share, first, last, ate / clean, ratios / (last - first + 1), worst);
}

}  // namespace

int main(int argc, char** argv) {
  lamina::keep_freed_memory();  // as the program does
  int repeat = 1;
  bool verbose = false, from_truth = false;
  double wrong = 0;
  lamina::RefineOptions options;
  options.robust = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--repeat") == 0 && i + 1 < argc) {
      repeat = std::max(1, std::atoi(argv[++i]));
    } else if (std::strcmp(argv[i], "--robust") == 0) {
      options.robust = true;
    } else if (std::strcmp(argv[i], "--from-evidence") == 0) {
      options.planes_from_evidence = true;
    } else if (std::strcmp(argv[i], "--from-truth") == 0) {
      from_truth = true;
    } else if (std::strcmp(argv[i], "--growth") == 0) {
      growth(options);
    } else if (std::strcmp(argv[i], "--verbose") == 0) {
      verbose = true;
    } else if (std::strcmp(argv[i], "--names") == 0 && i + 3 < argc) {
      wrong_names(std::atof(argv[i + 1]), std::atoi(argv[i + 2]), std::atoi(argv[i + 3]));
      i += 3;
    } else if (std::strcmp(argv[i], "--wrong") == 0 && i + 1 < argc) {
      wrong = std::atof(argv[++i]);
    } else if (std::strcmp(argv[i], "--rooms") == 0 && i + 1 < argc) {
      lamina::test::RoomOptions rooms;
      rooms.rooms = std::max(1, std::atoi(argv[++i]));
      rooms.wrong = wrong;
      run(std::string("rooms ") + argv[i], lamina::test::make_rooms(rooms), repeat, options,
          verbose);
    } else {
      try {
        lamina::PlaneGraph problem = lamina::read_plane_graph(argv[i]);
        if (from_truth) problem.initial_map_body = problem.truth_map_body;
        run(argv[i], problem, repeat, options, verbose);
      } catch (const lamina::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
      }
    }
  }
  return 0;
}
