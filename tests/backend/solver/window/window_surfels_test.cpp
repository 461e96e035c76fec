// Surfels in the window: as the batch has them, by either engine, and as they leave.
#include <lamina/backend/solver/window/sliding_window.hpp>

#include <gtest/gtest.h>

#include "backend/mapper/swelling_floor.hpp"

namespace lamina {
namespace {

using test::on_ground;
using test::patches_ahead;

constexpr double kCell = 0.25;  // m

struct Window {
  SlidingWindow window;
  std::map<std::pair<int, int>, SurfelId> cells;
  std::int64_t next = 0;

  explicit Window(const WindowOptions& options) : window(options) {}

  // Cells are told by where the body truly is.
  void see(KeyframeId keyframe, const SE3& T_map_body, const std::vector<Moments>& patches) {
    std::map<SurfelId, Moments> seen;
    for (const Moments& patch : patches) {
      const Eigen::Vector3d x = T_map_body * patch.mean();
      const std::pair<int, int> cell(static_cast<int>(std::floor(x.x() / kCell)),
                                     static_cast<int>(std::floor(x.y() / kCell)));
      const auto known = cells.find(cell);
      SurfelId id = known == cells.end() ? SurfelId::kNone : known->second;
      if (!window.contains(id)) {
        id = cells[cell] = SurfelId(next++);
        const SE3 T(SO3(), {(cell.first + 0.5) * kCell, (cell.second + 0.5) * kCell, 0});
        ASSERT_TRUE(window.add_surfel(id, T, {id, PlaneId(0), 0.02, 0.1}));
      }
      seen[id].merge(patch);
    }
    for (const auto& [id, m] : seen) EXPECT_TRUE(window.set({keyframe, id, m.scaled(0.05)}));
  }
};

WindowOptions tight(int keyframes, SolverEngine engine) {
  WindowOptions options;
  options.engine = engine;
  options.keyframes = keyframes;
  options.iterations = 20;
  options.stop_chi_squared = 1e-16;
  return options;
}

// 16 keyframes along 3 m of ground that swells; wheels take it for level.
Window drive(int keyframes, SolverEngine engine, bool surfels, double* height_rms) {
  std::mt19937 rng(11);
  std::normal_distribution<double> normal;
  Window w(tight(keyframes, engine));
  Matrix6d S = Matrix6d::Identity();
  S.diagonal() << 500, 500, 200, 100, 100, 500;
  SE3 T = on_ground(0, 0, 0);
  std::vector<SE3> truth{T};
  double squares = 0;
  for (int i = 0; i < 16; ++i) {
    if (i > 0) {
      truth.push_back(on_ground(0.2 * i, 0, 0));
      Vector6d noise;
      for (int k = 0; k < 6; ++k) noise(k) = normal(rng) / S(k, k);
      const SE3 moved = truth[truth.size() - 2].inverse() * truth.back() * SE3::exp(noise);
      T = w.window.pose(KeyframeId(i - 1)) * moved;
      w.window.add_keyframe(KeyframeId(i), {}, T);
      w.window.add(OdometryFactor{KeyframeId(i - 1), KeyframeId(i), moved, S});
    } else {
      w.window.add_keyframe(KeyframeId(0), {}, T);
      w.window.add(PriorFactor{KeyframeId(0), T, 1e4 * Matrix6d::Identity()});
      w.window.add_plane(PlaneId(0), Plane(Eigen::Vector3d::UnitZ(), 0), {0, 0, 0});
      w.window.add_prior(PlaneId(0), Plane(Eigen::Vector3d::UnitZ(), 0), 0.003, 0.005);
    }
    const auto patches = patches_ahead(truth.back(), 0.001, rng);
    if (surfels) w.see(KeyframeId(i), truth.back(), patches);
    EXPECT_TRUE(w.window.solve().finite);
    if (i + 1 < 16) w.window.marginalize();
    const double off =
        w.window.pose(KeyframeId(i)).translation().z() - truth.back().translation().z();
    squares += off * off / 16;
  }
  *height_rms = std::sqrt(squares);
  return w;
}

TEST(WindowSurfels, HoldTheBodyByEitherEngineAlike) {
  double without = 0, native = 0, ceres = 0;
  drive(6, SolverEngine::kNative, false, &without);
  const Window a = drive(6, SolverEngine::kNative, true, &native);
  const Window b = drive(6, SolverEngine::kCeres, true, &ceres);
  EXPECT_LT(native, 0.6 * without);
  ASSERT_EQ(a.window.surfel_count(), b.window.surfel_count());
  for (const KeyframeId id : a.window.keyframes())
    EXPECT_LT((a.window.pose(id).inverse() * b.window.pose(id)).log().norm(), 1e-3);
}

// What leaves with surfels loses nothing that mattered: the newest pose is as if all had stayed,
// but for cells that are begun anew.
TEST(WindowSurfels, LeaveAPriorBehind) {
  double all = 0, few = 0;
  const Window whole = drive(100, SolverEngine::kNative, true, &all);
  const Window lag = drive(11, SolverEngine::kNative, true, &few);
  EXPECT_EQ(lag.window.keyframe_count(), 12u);
  EXPECT_LT(lag.window.surfel_count(), whole.window.surfel_count());
  const KeyframeId newest{15};
  const Vector6d off = (whole.window.pose(newest).inverse() * lag.window.pose(newest)).log();
  EXPECT_LT(off.norm(), 0.003);
  const Matrix6d a = whole.window.newest_covariance(), b = lag.window.newest_covariance();
  for (int k = 2; k < 5; ++k) EXPECT_NEAR(std::sqrt(b(k, k) / a(k, k)), 1, 0.4) << k;
}

TEST(WindowSurfels, TheOriginDoesNotMatter) {
  double rms = 0;
  Window a = drive(6, SolverEngine::kNative, true, &rms), b = a;
  const SE3 T(SO3::rot_z(1.1), {300, -200, 5});
  b.window.move(T);
  for (Window* w : {&a, &b}) {
    w->window.add(GravityFactor{KeyframeId(15), Eigen::Vector3d(0.01, 0, 1).normalized(), 0.005});
    EXPECT_TRUE(w->window.solve().finite);
  }
  for (const KeyframeId id : a.window.keyframes())
    EXPECT_LT(((T * a.window.pose(id)).inverse() * b.window.pose(id)).log().norm(), 1e-6);
}

}  // namespace
}  // namespace lamina
