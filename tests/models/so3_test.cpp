// Rotations: exp and log at the edges.
#include <gtest/gtest.h>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/moments.hpp>
#include <lamina/models/polygon.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {
namespace {

TEST(SO3, ExpOfLogIsTheIdentity) {
  for (const double angle : {0.0, 1e-10, 1e-5, 1.0, M_PI - 1e-6}) {
    const Eigen::Vector3d w = angle * Eigen::Vector3d(1, 2, 3).normalized();
    EXPECT_LT((SO3::exp(w).log() - w).norm(), 1e-9) << angle;
  }
}

TEST(OutlineGrid, TracesASquare) {
  OutlineGrid grid(0.1);
  grid.add(*Polygon::from_vertices({{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  ASSERT_EQ(grid.outlines().size(), 1u);
  EXPECT_NEAR(grid.outlines()[0].area(), 1.0, 0.03);
}

}  // namespace
}  // namespace lamina
