// The refiner where many observations name the wrong plane.
#include <gtest/gtest.h>

#include <lamina/backend/plane_graph_solve.hpp>

#include "backend/room_generator.hpp"

namespace lamina {
namespace {

using test::make_rooms;
using test::RoomOptions;

TEST(Refiner, NamesWrongAssociations) {
  RoomOptions options;
  const double clean = solve_plane_graph(make_rooms(options)).ate_m;
  options.wrong = 0.3;
  const PlaneGraph problem = make_rooms(options);
  const PlaneGraphResult result = solve_plane_graph(problem);
  EXPECT_LE(result.ate_m, 1.5 * clean);
  // What was taken away is about what was wrong (six of seven draws name another room's plane or
  // another plane of this room).
  const double share = static_cast<double>(result.refine.rejected.size()) /
                       static_cast<double>(problem.observations.size());
  EXPECT_NEAR(share, 0.3, 0.08);
  for (const FactorRef& ref : result.refine.rejected) {
    EXPECT_EQ(ref.type, FactorType::kPlaneMoments);
    EXPECT_EQ(result.graph.plane_moments[ref.index].weight, 0);
  }
}

}  // namespace
}  // namespace lamina
