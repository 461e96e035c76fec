// The window against batch solutions; what must stay free; what must not matter.
#include <lamina/backend/solver/window/sliding_window.hpp>

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <random>

#include <lamina/backend/refine/refiner.hpp>

#include "backend/solver/window/hall.hpp"

namespace lamina {
namespace {

using test::Hall;

WindowOptions tight(int keyframes) {
  WindowOptions options;
  options.keyframes = keyframes;
  options.iterations = 20;
  options.stop_chi_squared = 1e-22;
  options.idle_keyframes = 100;
  return options;
}

// With noise so small that everything is linear, what was marginalised loses nothing.
TEST(SlidingWindow, EqualsTheBatchOnALinearProblem) {
  const Hall hall(30, 1e-6, 7);
  SlidingWindow window(tight(5)), batch(tight(1000));
  for (std::size_t i = 0; i < hall.truth.size(); ++i) {
    hall.feed(window, i);
    ASSERT_TRUE(window.solve().finite);
    if (i + 1 < hall.truth.size()) window.marginalize();
    hall.feed(batch, i);
  }
  ASSERT_TRUE(batch.solve().finite);
  EXPECT_LE(window.keyframe_count(), 6u);
  for (const KeyframeId id : window.keyframes()) {
    EXPECT_LT((window.pose(id).inverse() * batch.pose(id)).log().norm(), 1e-10);
  }
  for (const PlaneId id : window.planes()) {
    EXPECT_LT(window.plane_anchor(id).boxminus(batch.plane_anchor(id)).norm(), 1e-10);
  }
  EXPECT_TRUE(window.newest_covariance().isApprox(batch.newest_covariance(), 1e-4));
  const auto a = window.joint_covariance(PlaneId(3)), b = batch.joint_covariance(PlaneId(3));
  ASSERT_TRUE(a && b);
  EXPECT_TRUE(a->isApprox(*b, 1e-4));
}

TEST(SlidingWindow, JointCovariancesAgreeWithTheWholeInverse) {
  const Hall hall(8, 1, 3);
  SlidingWindow window(tight(100));
  for (std::size_t i = 0; i < hall.truth.size(); ++i) hall.feed(window, i);
  ASSERT_TRUE(window.solve().finite);
  const Eigen::MatrixXd C = window.covariance();
  const auto planes = window.planes();
  const auto joints = window.joint_covariances(planes);
  ASSERT_EQ(joints.size(), planes.size());
  for (std::size_t k = 0; k < planes.size(); ++k) {
    Eigen::Matrix<double, 9, 9> expected;
    const int a = 6 * 7, b = 6 * 8 + 3 * int(k);
    expected << C.block<6, 6>(a, a), C.block<6, 3>(a, b), C.block<3, 6>(b, a), C.block<3, 3>(b, b);
    EXPECT_TRUE(joints[k].second.isApprox(expected, 1e-8));
    EXPECT_TRUE(window.joint_covariance(planes[k])->isApprox(expected, 1e-8));
  }
}

// Each state's own covariance against the inverse of the whole, solved column by column.
void expect_blocks_of_the_inverse(const SlidingWindow& window) {
  const Eigen::MatrixXd C = window.covariance();
  const WindowCovariances own = window.covariances();
  ASSERT_EQ(own.poses.size(), window.keyframe_count());
  ASSERT_EQ(own.planes.size(), window.plane_count());
  for (std::size_t i = 0; i < own.poses.size(); ++i) {
    const Matrix6d expected = C.block<6, 6>(6 * int(i), 6 * int(i));
    EXPECT_LT((own.poses[i] - expected).norm(), 1e-9 * expected.norm()) << "pose " << i;
  }
  for (std::size_t j = 0; j < own.planes.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(6 * own.poses.size() + 3 * j);
    const Eigen::Matrix3d expected = C.block<3, 3>(at, at);
    EXPECT_LE((own.planes[j] - expected).norm(), 1e-9 * expected.norm()) << "plane " << j;
  }
}

TEST(SlidingWindow, OwnCovariancesAreTheDiagonalOfTheWhole) {
  const Hall hall(30, 1, 3);
  SlidingWindow window(tight(6));
  for (std::size_t i = 0; i < hall.truth.size(); ++i) {
    hall.feed(window, i);
    const WindowReport report = window.solve();
    ASSERT_TRUE(report.finite);
    EXPECT_EQ(window.covariances().held_directions, report.held_directions);
    if (i % 7 == 3) expect_blocks_of_the_inverse(window);
    if (i + 1 < hall.truth.size()) window.marginalize();
  }
  expect_blocks_of_the_inverse(window);
}

TEST(SlidingWindow, OwnCovariancesSayWhichDirectionsNothingTells) {
  const Hall hall(4, 1, 3);
  SlidingWindow window(tight(100));
  for (std::size_t i = 0; i < hall.truth.size(); ++i) hall.feed(window, i);
  window.add_plane(PlaneId(99), Plane({0, 0, 1}, -2), Eigen::Vector3d::Zero());
  const WindowReport report = window.solve();
  ASSERT_TRUE(report.finite);
  EXPECT_EQ(report.held_directions, 3);
  const WindowCovariances own = window.covariances();
  EXPECT_EQ(own.held_directions, 3);
  EXPECT_LT(own.planes.back().norm(), 1e-100);
  EXPECT_GT(own.planes.front().norm(), 0);
  expect_blocks_of_the_inverse(window);
}

// The refiner is another implementation of the same least squares.
TEST(SlidingWindow, EqualsTheRefinerWhileNothingLeft) {
  const Hall hall(12, 1, 11);
  SlidingWindow window(tight(1000));
  Graph graph;
  for (std::size_t i = 0; i < hall.truth.size(); ++i) {
    hall.feed(window, i);
    graph.add_keyframe(Timestamp::from_nanoseconds(int(i)), hall.guess[i]);
  }
  for (const auto& plane : hall.planes) {
    graph.add_plane(PlaneLandmark::at(plane, hall.truth[0].translation()));
  }
  graph.priors.push_back({KeyframeId(0), hall.truth[0], Matrix6d::Identity() * 1e4});
  graph.odometry = hall.odometry;
  graph.plane_moments = hall.sightings;
  RefineOptions options;
  options.robust = false;
  refine(graph, options);
  ASSERT_TRUE(window.solve().finite);
  for (const KeyframeId id : window.keyframes()) {
    EXPECT_LT((window.pose(id).inverse() * graph.at(id).T_map_body).log().norm(), 1e-5);
  }
}

// Turned and moved by 5 km: the same result, moved.
TEST(SlidingWindow, TheOriginDoesNotMatter) {
  const SE3 far(SO3::exp({0.4, -1.1, 2.3}), {5000, -3000, 200});
  const Hall here(25, 1, 5), there(25, 1, 5, far);
  SlidingWindow a(tight(6)), b(tight(6));
  for (std::size_t i = 0; i < here.truth.size(); ++i) {
    here.feed(a, i);
    there.feed(b, i);
    a.solve();
    b.solve();
    a.marginalize();
    b.marginalize();
  }
  for (const KeyframeId id : a.keyframes()) {
    EXPECT_LT(((far * a.pose(id)).inverse() * b.pose(id)).log().norm(), 1e-6);
  }
}

TEST(SlidingWindow, MovedAsAWholeItGoesOnAsBefore) {
  const SE3 shift(SO3::rot_z(0.7), {3, -2, 0.4});
  const Hall hall(20, 1, 9);
  SlidingWindow a(tight(6)), b(tight(6));
  for (std::size_t i = 0; i < hall.truth.size(); ++i) {
    hall.feed(a, i);
    if (i == 12) {
      b.move(shift);
      for (const PlaneId id : b.planes()) b.set_anchor(id, Eigen::Vector3d(1, 2, 3));
    }
    if (i < 12) {
      hall.feed(b, i);
    } else {
      const auto id = static_cast<KeyframeId>(i);
      b.add_keyframe(id, {}, b.pose(KeyframeId(int(i) - 1)) * hall.odometry[i - 1].T_from_to);
      b.add(hall.odometry[i - 1]);
      for (const auto& s : hall.sightings) {
        if (s.keyframe == id) b.add(s);
      }
    }
    a.solve();
    b.solve();
    a.marginalize();
    b.marginalize();
  }
  for (const KeyframeId id : a.keyframes()) {
    // Another anchor is exact to first order: what is left is second order in the noise.
    EXPECT_LT(((shift * a.pose(id)).inverse() * b.pose(id)).log().norm(), 5e-5);
  }
}

// No prior on any pose: the whole window may still move and turn as one after marginalisation.
TEST(SlidingWindow, TheGaugeStaysFree) {
  const Hall hall(15, 1e-3, 13);
  SlidingWindow window(tight(6));
  for (std::size_t i = 0; i < hall.truth.size(); ++i) {
    hall.feed(window, i, false);
    const WindowReport report = window.solve();
    ASSERT_TRUE(report.finite);
    window.marginalize();
  }
  const MarginalPrior prior = window.prior();
  ASSERT_GT(prior.sqrt_information.rows(), 0);
  ASSERT_EQ(prior.sqrt_information.cols(), prior.dimension());
  const double scale = prior.sqrt_information.norm();
  // Six directions carry nothing at all. Counted by singular values, not by rows: the root is
  // triangular without pivoting, and where a column depends on earlier ones it takes one row more.
  const Eigen::VectorXd sigma =
      Eigen::JacobiSVD<Eigen::MatrixXd>(prior.sqrt_information).singularValues();
  const Eigen::Index informed = prior.dimension() - 6;
  ASSERT_GE(sigma.size(), informed);
  EXPECT_GT(sigma(informed - 1), 1e-4 * scale);
  EXPECT_LT(sigma.tail(sigma.size() - informed).sum(), 1e-12 * scale);
  // And they are the motions of the world, to first order, at the linearisation points (they
  // hardly moved).
  for (int k = 0; k < 6; ++k) {
    const Vector6d xi = Vector6d::Unit(k) * 1e-6;
    Eigen::VectorXd d(prior.dimension());
    for (std::size_t i = 0; i < prior.keyframes.size(); ++i) {
      d.segment<6>(6 * Eigen::Index(i)) = prior.poses_linear[i].inverse().adjoint() * xi;
    }
    for (std::size_t i = 0; i < prior.planes.size(); ++i) {
      const auto j = static_cast<std::size_t>(prior.planes[i]);
      const Eigen::Vector3d anchor = hall.planes[j].project(hall.truth[0].translation());
      const Plane plane = prior.planes_linear[i].about(-anchor);
      d.segment<3>(6 * Eigen::Index(prior.keyframes.size()) + 3 * Eigen::Index(i)) =
          (SE3::exp(xi) * plane).about(anchor).boxminus(prior.planes_linear[i]);
    }
    EXPECT_LT((prior.sqrt_information * d).norm(), 1e-5 * scale * d.norm()) << k;
  }
}

TEST(SlidingWindow, RenamedPlanesKeepWhatIsKnownOfThem) {
  const Hall hall(12, 1, 17);
  SlidingWindow window(tight(6));
  for (std::size_t i = 0; i < hall.truth.size(); ++i) {
    hall.feed(window, i);
    window.solve();
    window.marginalize();
  }
  const Plane before = window.plane_anchor(PlaneId(2));
  EXPECT_TRUE(window.rename_plane(PlaneId(2), PlaneId(77)));
  EXPECT_FALSE(window.rename_plane(PlaneId(2), PlaneId(78)));
  EXPECT_FALSE(window.rename_plane(PlaneId(1), PlaneId(77)));
  ASSERT_TRUE(window.solve().finite);
  EXPECT_LT(window.plane_anchor(PlaneId(77)).boxminus(before).norm(), 1e-8);
}

TEST(SlidingWindow, UnknownIdsAndNumbersThatAreNoneAreTurnedAway) {
  SlidingWindow window(tight(6));
  EXPECT_FALSE(window.add(PlaneMomentsFactor{}));
  EXPECT_FALSE(window.add(OdometryFactor{}));
  EXPECT_FALSE(window.add(PriorFactor{}));
  window.add_keyframe(KeyframeId(0), {}, SE3());
  window.add_plane(PlaneId(0), Plane(), Eigen::Vector3d::Zero());
  PlaneMomentsFactor bad{KeyframeId(0), PlaneId(0), {}, ExtrinsicsId::kNone, 1.0};
  bad.moments_body = Moments(std::nan(""), Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero(), 3);
  EXPECT_FALSE(window.add(bad));
  // Nothing known at all: everything is held, and said to be.
  const WindowReport report = window.solve();
  EXPECT_TRUE(report.finite);
  EXPECT_EQ(report.held_directions, 9);
  EXPECT_TRUE(window.pose(KeyframeId(0)).translation().isZero());
}

TEST(SlidingWindow, AnOddSightingIsOutvoted) {
  Hall hall(10, 1, 19);
  const Hall clean = hall;
  auto& s = hall.sightings[hall.sightings.size() / 2];
  s.moments_body =
      Moments(s.moments_body.weight(), s.moments_body.mean() + Eigen::Vector3d(0.3, 0.3, 0.3),
              s.moments_body.scatter(), 100);
  SlidingWindow a(tight(100)), b(tight(100));
  for (std::size_t i = 0; i < hall.truth.size(); ++i) {
    hall.feed(a, i);
    clean.feed(b, i);
  }
  a.solve();
  b.solve();
  for (const KeyframeId id : a.keyframes()) {
    EXPECT_LT((a.pose(id).translation() - b.pose(id).translation()).norm(), 0.03);
  }
}

// One factor serves several steps and robust weights are kept: where that ends is the minimum.
TEST(SlidingWindow, StepsWithOneFactorEndWhereManyFactorsDo) {
  Hall hall(40, 1, 23);
  for (std::size_t k = 5; k < hall.sightings.size(); k += 9) {  // some out by six sigmas
    auto& m = hall.sightings[k].moments_body;
    m = Moments(m.weight(), m.mean() + Eigen::Vector3d::Constant(6 / std::sqrt(m.weight())),
                m.scatter(), 100);
  }
  WindowOptions usual;
  usual.keyframes = 10;
  WindowOptions exact = usual;
  exact.iterations = 50;
  exact.stop_chi_squared = 1e-16;
  SlidingWindow a(usual), b(exact);
  for (std::size_t i = 0; i < hall.truth.size(); ++i) {
    const auto id = static_cast<KeyframeId>(i);
    hall.feed(a, i);
    hall.feed(b, i);
    ASSERT_TRUE(a.solve().finite);
    ASSERT_TRUE(b.solve().finite);
    const Vector6d e = (a.pose(id).inverse() * b.pose(id)).log();
    // Of what the stopping rule leaves: a fraction of a sigma. Covariances to a tenth.
    EXPECT_LT(e.dot(b.newest_covariance().ldlt().solve(e)), 0.1) << i;
    EXPECT_TRUE(a.newest_covariance().isApprox(b.newest_covariance(), 0.1)) << i;
    a.marginalize();
    b.marginalize();
  }
}

TEST(WindowOptions, SaysWhatCannotBe) {
  EXPECT_TRUE(WindowOptions().problems().empty());
  WindowOptions options;
  options.keyframes = 2;
  options.return_inflation = 0.5;
  EXPECT_EQ(options.problems().size(), 2u);
}

}  // namespace
}  // namespace lamina
