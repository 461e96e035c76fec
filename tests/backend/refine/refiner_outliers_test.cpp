// The refiner where many observations name the wrong plane.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

#include "backend/mapper/room_generator.hpp"

namespace lamina {
namespace {

using test::make_rooms;
using test::RoomOptions;

/// Chi-squared of an observation at the true pose and the true plane it names: beyond this the name
/// is wrong in a way that shows. Floors of all rooms are one surface: some wrong names are true.
constexpr double kShows = 40;

struct Names {
  int wrong = 0, found = 0, falsely = 0;
};

Names judge_names(const PlaneGraph& problem, const PlaneGraphResult& result) {
  Names names;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const PlaneGraph::Observation& o = problem.observations[i];
    const PlaneMomentsFactor& factor = result.graph.plane_moments[i];
    const Plane truth_body = problem.truth_map_body[static_cast<std::size_t>(o.pose)].inverse() *
                             problem.truth_planes[static_cast<std::size_t>(o.plane)];
    const bool wrong = factor.moments_body.cost(truth_body) > kShows;
    const bool rejected = factor.weight < 0.5;
    names.wrong += wrong;
    names.found += wrong && rejected;
    names.falsely += !wrong && rejected;
  }
  return names;
}

struct Trial {
  double ate = 0, clean = 0;  ///< m; clean: the same problem with right names
  Names names;
  SolveStatus status = SolveStatus::kNothingToSolve;
};

Trial solve_with_wrong_names(double share, std::uint64_t seed) {
  RoomOptions options;
  options.seed = seed;
  const double clean = solve_plane_graph(make_rooms(options)).ate_m;
  options.wrong = share;
  const PlaneGraph problem = make_rooms(options);
  const PlaneGraphResult result = solve_plane_graph(problem);
  return {result.ate_m, clean, judge_names(problem, result), result.refine.status};
}

/// Over seeds, because one seed's ATE is a throw of the dice: fewer observations can be luckier.
struct Sums {
  double ate = 0, clean = 0, ratios = 0, worst = 0;
  Names names;
};

// The figures of docs/backend.md.
void print(double share, std::uint64_t seeds, const Sums& sums) {
  std::printf(
      "share %.1f, %d seeds: ATE over clean %.2f in the sum, %.2f in the mean, %.2f at worst; "
      "wrong names found %.1f %%, right ones lost %.1f %% of the wrong ones' number\n",
      share, static_cast<int>(seeds), sums.ate / sums.clean,
      sums.ratios / static_cast<double>(seeds), sums.worst,
      100.0 * sums.names.found / sums.names.wrong, 100.0 * sums.names.falsely / sums.names.wrong);
}

Sums solve_seeds(double share, std::uint64_t seeds) {
  Sums sums;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Trial trial = solve_with_wrong_names(share, seed);
    EXPECT_EQ(trial.status, SolveStatus::kConverged) << "seed " << seed;
    sums.ate += trial.ate;
    sums.clean += trial.clean;
    sums.ratios += trial.ate / trial.clean;
    sums.worst = std::max(sums.worst, trial.ate / trial.clean);
    sums.names.wrong += trial.names.wrong;
    sums.names.found += trial.names.found;
    sums.names.falsely += trial.names.falsely;
  }
  print(share, seeds, sums);
  return sums;
}

TEST(RefinerOutliers, ThirtyPercentWrongNamesHardlyShow) {
  const Sums sums = solve_seeds(0.3, 25);
  EXPECT_LE(sums.ate, 1.1 * sums.clean);
  EXPECT_GE(sums.names.found, 0.98 * sums.names.wrong);
  EXPECT_LE(sums.names.falsely, 0.1 * sums.names.wrong);
}

TEST(RefinerOutliers, SeventyPercentWrongNamesAreFound) {
  const Sums sums = solve_seeds(0.7, 25);
  EXPECT_LE(sums.ate, 1.5 * sums.clean);
  EXPECT_GE(sums.names.found, 0.95 * sums.names.wrong);
}

}  // namespace
}  // namespace lamina
