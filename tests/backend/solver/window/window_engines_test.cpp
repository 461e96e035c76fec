// Gauss-Newton and Ceres on one window.
#include <gtest/gtest.h>

#include <lamina/backend/solver/window/sliding_window.hpp>

#include "backend/solver/window/hall.hpp"

namespace lamina {
namespace {

using test::Hall;

// Through everything that changes a window's factors: leaving, moving, other names and anchors.
TEST(WindowEngines, BothEnginesFindTheSameEstimates) {
  const Hall hall(36, 1.0, 7);
  WindowOptions options;
  options.keyframes = 8;
  options.iterations = 20;
  options.stop_chi_squared = 1e-10;
  SlidingWindow native(options);
  options.engine = SolverEngine::kCeres;
  SlidingWindow ceres(options);
  for (std::size_t i = 0; i < hall.guess.size(); ++i) {
    for (SlidingWindow* window : {&native, &ceres}) {
      hall.feed(*window, i);
      if (i == 12) {
        EXPECT_TRUE(window->rename_plane(PlaneId(4), PlaneId(9)));
      }
      if (i == 14) window->move(SE3(SO3::rot_z(0.3), {2, -1, 0.5}));
      if (i == 17 && window->contains(PlaneId(9)) && window->contains(PlaneId(4))) {
        EXPECT_TRUE(window->merge_planes(PlaneId(4), PlaneId(9)));
      }
      if (i == 20) window->set_anchor(PlaneId(1), Eigen::Vector3d(3, -4, 1));
      ASSERT_TRUE(window->solve().finite) << i;
    }
    const auto id = static_cast<KeyframeId>(i);
    // A hundredth of a sigma: first estimates make the gradient inexact, and each ends where no
    // step lowers the cost.
    EXPECT_LT((native.pose(id).inverse() * ceres.pose(id)).log().norm(), 1e-4) << i;
    for (const PlaneId plane : native.planes()) {
      EXPECT_LT(native.plane_anchor(plane).boxminus(ceres.plane_anchor(plane)).norm(), 1e-4) << i;
    }
    const Matrix6d C = native.newest_covariance();
    EXPECT_LT((C - ceres.newest_covariance()).norm(), 1e-2 * C.norm()) << i;
    for (SlidingWindow* window : {&native, &ceres}) {
      window->marginalize();
      if (i == 15) {
        const SlidingWindow copy = *window;  // a value: the copy goes on by itself
        *window = copy;
      }
    }
  }
}

}  // namespace
}  // namespace lamina
