// States that left a window: nothing of what ties them to the rest is lost.
#include <lamina/backend/solver/window/dormant_states.hpp>

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>
#include <lamina/pipeline/evaluation/window_plane_graph.hpp>

#include "backend/mapper/room_generator.hpp"

namespace lamina {
namespace {

Eigen::MatrixXd random_matrix(std::mt19937& rng, int rows, int columns) {
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(rng); });
}

// Columns of a random problem: x (3), y (3), then a, b, c, d of two each. Every row a factor.
struct Problem {
  explicit Problem(unsigned seed) : rng(seed), J(random_matrix(rng, 40, 14)) {
    r = random_matrix(rng, 40, 1);
  }
  Eigen::MatrixXd information() const { return J.transpose() * J; }
  std::mt19937 rng;
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
};

// x and y leave, then a; x comes back: prior and conditional are those of the whole problem.
TEST(StatesBehind, LeavingAndComingBackLosesNothing) {
  const Problem all(1);
  const LinearSystem first{all.J, all.r, 6};
  const SquareRootInformation prior = eliminate_by_qr(first);
  ASSERT_TRUE(prior.eliminated);
  StatesBehind behind;
  Eigen::MatrixXd newcomers = Eigen::MatrixXd::Zero(6, 14);
  newcomers.leftCols(6).setIdentity();
  behind.eliminate({}, newcomers, *prior.eliminated);

  // The interface has moved by `step` when a leaves: residuals are those there.
  const Eigen::VectorXd step = Eigen::VectorXd::LinSpaced(8, -1, 1);
  const SquareRootInformation later =
      eliminate_by_qr({prior.R, prior.r + prior.R * step, /*eliminated_columns=*/2});
  ASSERT_TRUE(later.eliminated);
  behind.eliminate(step, behind.gain(), *later.eliminated);
  ASSERT_EQ(behind.size(), 6);
  ASSERT_EQ(behind.gain().cols(), 6);

  // Of the whole problem, a integrated out: y and x given b, c, d.
  const Eigen::MatrixXd H = all.information(), C = H.inverse();
  const auto tie = behind.take(0);
  ASSERT_TRUE(tie);
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(later.R.rows() + 3, 9);
  R.topLeftCorner(later.R.rows(), 6) = later.R;
  R.bottomRows(3) = tie->R;
  Eigen::VectorXd r(R.rows());
  r << later.r, tie->r;
  std::vector<int> kept{8, 9, 10, 11, 12, 13, 0, 1, 2};  // b, c, d, x
  EXPECT_TRUE((R.transpose() * R).inverse().isApprox(C(kept, kept), 1e-9));
  // The least is where the whole problem has it; steps of b, c, d count from `step`.
  const Eigen::VectorXd best = -(H.ldlt().solve(all.J.transpose() * all.r));
  Eigen::VectorXd expected = best(kept);
  expected.head(6) -= step.tail(6);
  const Eigen::VectorXd found = -(R.transpose() * R).ldlt().solve(R.transpose() * r);
  EXPECT_TRUE(found.isApprox(expected, 1e-9));

  // y given b, c, d and x.
  const std::vector<int> y{3, 4, 5};
  const Eigen::MatrixXd given = C(kept, kept).inverse();
  const Eigen::MatrixXd left = C(y, y) - C(y, kept) * given * C(kept, y);
  EXPECT_TRUE(behind.covariance().isApprox(left, 1e-9));
  EXPECT_TRUE(behind.mean(found).isApprox(best(y), 1e-9));
}

TEST(StatesBehind, WhatIsForgottenDoesNotChangeTheRest) {
  const Problem all(2);
  const SquareRootInformation prior = eliminate_by_qr({all.J, all.r, 6});
  ASSERT_TRUE(prior.eliminated);
  StatesBehind both;
  Eigen::MatrixXd newcomers = Eigen::MatrixXd::Zero(6, 14);
  newcomers.leftCols(6).setIdentity();
  both.eliminate({}, newcomers, *prior.eliminated);
  const Eigen::MatrixXd C = both.covariance();
  const Eigen::VectorXd mean = both.mean(Eigen::VectorXd::Ones(8));
  both.drop(0);
  EXPECT_EQ(both.size(), 3);
  EXPECT_TRUE(both.covariance().isApprox(C.bottomRightCorner(3, 3)));
  EXPECT_TRUE(both.mean(Eigen::VectorXd::Ones(8)).isApprox(mean.tail(3)));
}

TEST(StatesBehind, WhatHasNoEvidenceIsNoConditional) {
  Problem all(3);
  all.J.col(1).setZero();
  EXPECT_FALSE(eliminate_by_qr({all.J, all.r, 6}).eliminated);
}

// Two laps of nine rooms: planes that leave and come back against planes that never leave.
TEST(StatesBehind, AWindowIsAsIfPlanesHadNeverLeft) {
  const PlaneGraph problem = test::make_rooms({.rooms = 4, .seed = 5});
  WindowOptions leaving, staying;
  leaving.keyframes = staying.keyframes = 6;
  leaving.idle_keyframes = 0;
  staying.idle_keyframes = 1000;
  staying.max_planes = 1000;
  const WindowRun a = run_window_on_plane_graph(problem, leaving, true);
  const WindowRun b = run_window_on_plane_graph(problem, staying, true);
  ASSERT_TRUE(a.finite && b.finite);
  double worst = 0, forgotten = 0;
  leaving.planes_behind = 0;
  const WindowRun c = run_window_on_plane_graph(problem, leaving, true);
  for (std::size_t i = 0; i < problem.truth_map_body.size(); ++i) {
    const auto off = [&](const WindowRun& run) {
      return (run.T_map_newest[i].inverse() * b.T_map_newest[i]).log().norm();
    };
    worst = std::max(worst, off(a));
    forgotten = std::max(forgotten, off(c));
    EXPECT_TRUE(a.newest_covariance[i].isApprox(b.newest_covariance[i], 1e-3)) << i;
  }
  EXPECT_LT(worst, 1e-4);       // the rest is when steps stop and where Jacobians are taken
  EXPECT_GT(forgotten, 0.005);  // it does matter
}

// A floor seen by all of eight keyframes, a wall by the first two: it has left when this returns.
WindowDepartures::Landmark wall_that_left(SlidingWindow& window) {
  Moments floor, wall;
  for (const double a : {-1.0, 0.0, 1.0}) {
    for (const double b : {-1.0, 0.0, 1.0}) {
      floor.add({a, b, 0}, 1e4);
      wall.add({2, a, b}, 1e4);
    }
  }
  window.add_keyframe(KeyframeId(0), Timestamp::from_nanoseconds(0), SE3());
  window.add(PriorFactor{KeyframeId(0), SE3(), Matrix6d::Identity() * 1e3});
  window.add_plane(PlaneId(0), Plane(Eigen::Vector3d::UnitZ(), 0), Eigen::Vector3d::Zero());
  window.add_plane(PlaneId(1), Plane(Eigen::Vector3d::UnitX(), 0), {2, 0, 0});
  for (int i = 0; i < 8; ++i) {
    const auto id = static_cast<KeyframeId>(i);
    if (i > 0) {
      window.add_keyframe(id, Timestamp::from_nanoseconds(i), SE3());
      window.add(OdometryFactor{KeyframeId(i - 1), id, SE3(), Matrix6d::Identity() * 100});
    }
    window.add(PlaneMomentsFactor{id, PlaneId(0), floor, ExtrinsicsId::kNone, 1.0});
    if (i < 2) window.add(PlaneMomentsFactor{id, PlaneId(1), wall, ExtrinsicsId::kNone, 1.0});
    window.solve();
    const WindowDepartures gone = window.marginalize();
    if (!gone.planes.empty()) return gone.planes.front();
  }
  return {};
}

WindowOptions short_memory() {
  WindowOptions options;
  options.keyframes = 3;
  options.idle_keyframes = 0;
  return options;
}

TEST(StatesBehind, APlaneThatWasMovedAlongComesBack) {
  SlidingWindow window(short_memory());
  const auto wall = wall_that_left(window);
  ASSERT_EQ(wall.id, PlaneId(1));
  const SE3 T(SO3::rot_z(0.7), {5000, -2000, 3});
  window.move(T);
  const Plane moved(T.so3() * wall.plane_anchor.normal(), wall.plane_anchor.rho());
  EXPECT_TRUE(window.add_plane(wall.id, moved, T * Eigen::Vector3d(2, 0, 0), wall.covariance));
  ASSERT_TRUE(window.solve().finite);
  EXPECT_LT(window.plane_anchor(wall.id).boxminus(moved).norm(), 1e-9);
  // As sure of it as when it left: nothing was seen of it since.
  const auto joint = window.joint_covariance(wall.id);
  ASSERT_TRUE(joint);
  const Eigen::Matrix3d C = joint->bottomRightCorner<3, 3>();
  EXPECT_NEAR(C.trace(), wall.covariance.trace(), 1e-6 * wall.covariance.trace());
}

TEST(StatesBehind, APlaneEstimatedSinceComesBackByItsCovarianceAlone) {
  SlidingWindow window(short_memory());
  const auto wall = wall_that_left(window);
  ASSERT_EQ(wall.id, PlaneId(1));
  const Plane refined(wall.plane_anchor.normal(), wall.plane_anchor.rho() + 0.001);
  EXPECT_FALSE(window.add_plane(wall.id, refined, {2, 0, 0}, wall.covariance));
  EXPECT_EQ(window.plane_anchor(wall.id).rho(), refined.rho());
}

}  // namespace
}  // namespace lamina
