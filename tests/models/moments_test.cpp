// Moments: sums that stay sound far from the origin, fits and their covariance.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include <lamina/models/moments.hpp>

#include "support/matchers.hpp"
#include "support/random.hpp"
#include "support/statistics.hpp"

namespace lamina::test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Points = std::vector<Eigen::Vector3d>;

Moments moments_of(const Points& points, double weight = 1.0) {
  Moments moments;
  for (const auto& point : points) moments.add(point, weight);
  return moments;
}

TEST(Moments, ByHand) {
  Moments moments;
  moments.add({0, 0, 0}, 1);
  moments.add({4, 0, 0}, 3);
  EXPECT_EQ(moments.weight(), 4);
  EXPECT_EQ(moments.count(), 2);
  EXPECT_THAT(moments.mean(), IsNear(Eigen::Vector3d(3, 0, 0), 1e-15));
  EXPECT_NEAR(moments.scatter()(0, 0), 1 * 9 + 3 * 1, 1e-14);
  EXPECT_TRUE(Moments().empty());
  EXPECT_FALSE(moments.empty());
}

TEST(Moments, BadPointsAreIgnored) {
  Moments moments;
  moments.add({kNaN, 0, 0});
  moments.add({0, 0, 1}, 0);
  moments.add({0, 0, 1}, -1);
  moments.add({0, 0, 1}, kNaN);
  moments.add({0, std::numeric_limits<double>::infinity(), 1});
  moments.add({0, 0, 1}, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(moments.empty());
  EXPECT_FALSE(moments.fit_plane({0, 0, 1}));
  EXPECT_FALSE(moments.fit_line());
  moments.merge(Moments());
  EXPECT_TRUE(moments.empty());
}

TEST(Moments, AddingThenRemovingGivesBackTheSame) {
  Random random(1);
  for (const double far : {0.0, 100.0, 5000.0}) {
    const Eigen::Vector3d center(far, -far, far);
    const SE3 T = SE3::from_translation(center);
    const Plane wall(random.unit_vector(), 0);
    const Points points = random.points_on(T * wall, center, 2, 50, 0.01);
    const Moments before = moments_of(points);
    Moments moments = before;
    const Points more = random.points_on(T * Plane(), center, 3, 200, 0.1);
    for (const auto& point : more) moments.add(point);
    for (const auto& point : more) moments.remove(point);
    EXPECT_THAT(moments, IsNear(before, 1e-9)) << far;
  }
}

TEST(Moments, RemovingEverythingLeavesNothing) {
  Moments moments;
  moments.add({1, 2, 3}, 0.1);
  moments.add({3, 2, 1}, 0.2);
  moments.remove({1, 2, 3}, 0.1);
  moments.remove({3, 2, 1}, 0.2);
  EXPECT_TRUE(moments.empty());
  EXPECT_EQ(moments.scatter(), Eigen::Matrix3d::Zero());
}

TEST(Moments, MergeIsAddingAllPoints) {
  Random random(2);
  const Points a = random.points_on(random.plane(3), {1, 0, 0}, 2, 40, 0.1);
  const Points b = random.points_on(random.plane(3), {50, 0, 0}, 2, 70, 0.1);
  Moments merged = moments_of(a, 2.0), all = merged;
  merged.merge(moments_of(b, 0.5));
  for (const auto& point : b) all.add(point, 0.5);
  EXPECT_THAT(merged, IsNear(all, 1e-12));
  merged.subtract(moments_of(b, 0.5));
  EXPECT_THAT(merged, IsNear(moments_of(a, 2.0), 1e-9));
}

TEST(Moments, TransformIsRecomputation) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const SE3 T_a_b = random.pose(i < 10 ? 5 : 5000);
    const Points points_b = random.points_on(random.plane(2), {1, 1, 0}, 2, 30, 0.1);
    Points points_a;
    for (const auto& point : points_b) points_a.push_back(T_a_b * point);
    EXPECT_THAT(moments_of(points_b).transformed(T_a_b), IsNear(moments_of(points_a), 1e-10));
  }
}

TEST(Moments, ScaledIsOtherWeights) {
  Random random(4);
  const Points points = random.points_on(random.plane(2), {1, 1, 0}, 2, 30, 0.1);
  EXPECT_THAT(moments_of(points).scaled(2.5), IsNear(moments_of(points, 2.5), 1e-12));
}

TEST(Moments, HomogeneousFormThereAndBack) {
  Random random(5);
  const Points points = random.points_on(random.plane(2), {1, 1, 0}, 2, 30, 0.1);
  const Moments moments = moments_of(points, 3.0);
  Eigen::Matrix4d M = Eigen::Matrix4d::Zero();
  for (const auto& x : points) M += 3.0 * x.homogeneous() * x.homogeneous().transpose();
  EXPECT_THAT(moments.homogeneous(), IsNear(M, 1e-10));
  EXPECT_THAT(*Moments::from_homogeneous(M, 30), IsNear(moments, 1e-11));
  EXPECT_FALSE(Moments::from_homogeneous(Eigen::Matrix4d::Zero()));
  EXPECT_FALSE(Moments::from_homogeneous(Eigen::Matrix4d::Constant(kNaN)));
}

// The idea that carries the weight: p^T M p is the sum over all points, for any plane.
TEST(Moments, CostIsTheSumOverItsPoints) {
  Random random(6);
  const Points points = random.points_on(random.plane(2), {3, 1, 0}, 2, 30, 0.1);
  const Moments moments = moments_of(points, 4.0);
  for (int i = 0; i < 20; ++i) {
    const Plane plane = random.plane(5);
    double sum = 0;
    for (const auto& x : points) sum += 4.0 * std::pow(plane.signed_distance(x), 2);
    EXPECT_NEAR(moments.cost(plane), sum, 1e-11 * sum);
    const Eigen::Vector4d p = plane.homogeneous();
    EXPECT_NEAR(p.dot(moments.homogeneous() * p), sum, 1e-11 * sum);
  }
}

TEST(Moments, FitFindsThePlane) {
  Random random(7);
  for (int i = 0; i < 30; ++i) {
    const Plane truth = random.plane(3);
    const Eigen::Vector3d eye = truth.project({0, 0, 0}) + 2.0 * truth.normal();
    const Moments moments = moments_of(random.points_on(truth, {1, 0, 0}, 2, 20));
    const auto fit = moments.fit_plane(eye);
    ASSERT_TRUE(fit);
    EXPECT_THAT(fit->plane, IsNear(truth, 1e-12));
    EXPECT_LT(fit->rms, 1e-7);
    EXPECT_LE(fit->eigenvalues(0), fit->eigenvalues(1));
    EXPECT_LE(fit->eigenvalues(1), fit->eigenvalues(2));
  }
}

// Points 5 km away fit as the same points at the origin do, to a micrometre: the distance between
// the fitted planes is taken at the points, where it matters, as rho itself is normal times 5 km.
TEST(Moments, FitFiveKilometresAwayIsTheFitAtTheOriginMoved) {
  Random random(8);
  for (int i = 0; i < 20; ++i) {
    const Points near = random.points_on(random.plane(1), {0, 0, 0}, 1, 100, 0.01);
    const SE3 T_far_near(random.rotation(), 5000.0 * random.unit_vector());
    Points far;
    for (const auto& point : near) far.push_back(T_far_near * point);
    const Eigen::Vector3d eye(0, 0, 3);
    const auto fit_near = moments_of(near).fit_plane(eye);
    const auto fit_far = moments_of(far).fit_plane(T_far_near * eye);
    ASSERT_TRUE(fit_near && fit_far);
    const Plane moved = T_far_near * fit_near->plane;
    for (const auto& point : far) {
      EXPECT_NEAR(fit_far->plane.signed_distance(point), moved.signed_distance(point), 1e-9);
    }
    EXPECT_NEAR(fit_far->plane.rho(), moved.rho(), 1e-6);
    EXPECT_THAT(fit_far->plane.normal(), IsNear(moved.normal(), 1e-10));
    EXPECT_NEAR(fit_far->rms, fit_near->rms, 1e-10);
  }
}

TEST(Moments, DegenerateFitsAreNullopt) {
  const Eigen::Vector3d eye(0, 0, 5);
  EXPECT_FALSE(moments_of({{0, 0, 0}, {1, 0, 0}}).fit_plane(eye));
  EXPECT_FALSE(moments_of({{0, 0, 0}, {1, 1, 0}, {2, 2, 0}}).fit_plane(eye)) << "on a line";
  EXPECT_FALSE(moments_of(Points(4, {1, 2, 3})).fit_plane(eye)) << "in one place";
  EXPECT_TRUE(moments_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).fit_plane(eye)) << "three will do";
  const Moments bad(1, {kNaN, 0, 0}, Eigen::Matrix3d::Identity(), 5);
  EXPECT_FALSE(bad.fit_plane(eye));
  EXPECT_FALSE(bad.fit_line());
  // On a line 5 km away rounding spreads the points: still no plane.
  const Eigen::Vector3d far(3000, 4000, 10), along = Eigen::Vector3d(1, 2, 3).normalized();
  Moments line;
  for (int i = 0; i < 100; ++i) line.add(far + 0.01 * i * along);
  EXPECT_FALSE(line.fit_plane(eye));
}

PlaneFit fit_of(Random& random, const Plane& truth, double sigma, bool observed) {
  const Points points = random.points_on(truth, {2, 1, 0}, 1.0, 60, sigma);
  const Eigen::Vector3d eye = truth.project({2, 1, 0}) + truth.normal();
  return *(observed ? moments_of(points, 1 / (sigma * sigma)).fit_plane(eye, 1.0)
                    : moments_of(points).fit_plane(eye));
}

// Error of the fit in the tangent its covariance is given in: about the centroid.
ErrorAndCovariance error_of(const PlaneFit& fit, const Moments& moments, const Plane& truth) {
  return {truth.about(moments.mean()).boxminus(fit.plane.about(moments.mean())), fit.covariance};
}

TEST(Moments, CovarianceOfThePlaneFitIsConsistent) {
  Random setup(9);
  for (int i = 0; i < 4; ++i) {
    const Plane truth = i == 0 ? Plane() : setup.plane(2);
    const double sigma = i % 2 ? 0.02 : 0.002;
    const auto draw = [&](Random& random) {
      const Points points = random.points_on(truth, {2, 1, 0}, 1.0, 60, sigma);
      const Moments moments = moments_of(points, 1 / (sigma * sigma));
      const Eigen::Vector3d eye = truth.project({2, 1, 0}) + truth.normal();
      return error_of(*moments.fit_plane(eye, 1.0), moments, truth);
    };
    EXPECT_TRUE(is_consistent(draw, 1500)) << i;
  }
}

TEST(Moments, SigmaIsEstimatedFromTheResidualsWhenNotGiven) {
  Random random(10);
  const Plane truth = random.plane(2);
  double sum = 0;
  for (int i = 0; i < 400; ++i) {
    const PlaneFit observed = fit_of(random, truth, 0.01, true);
    const PlaneFit guessed = fit_of(random, truth, 0.01, false);
    sum += guessed.covariance(2, 2) / observed.covariance(2, 2);
  }
  EXPECT_NEAR(sum / 400, 1.0, 0.05);
}

TEST(Moments, LineFit) {
  Random random(11);
  const Eigen::Vector3d along = random.unit_vector(), start(1, 2, 3);
  Moments moments;
  for (int i = 0; i <= 10; ++i) moments.add(start + 0.1 * i * along);
  const auto fit = moments.fit_line();
  ASSERT_TRUE(fit);
  EXPECT_NEAR(std::abs(fit->direction.dot(along)), 1, 1e-14);
  EXPECT_LT(fit->rms, 1e-8);
  EXPECT_FALSE(moments_of({{1, 2, 3}}).fit_line());
  EXPECT_FALSE(moments_of(Points(3, {1, 2, 3})).fit_line());
}

TEST(Moments, CovarianceOfTheLineFitIsConsistent) {
  const Eigen::Vector3d along = Eigen::Vector3d(1, -2, 0.5).normalized(), start(4, 2, 1);
  const double sigma = 0.01;
  const auto draw = [&](Random& random) {
    Moments moments;
    for (int i = 0; i < 40; ++i) {
      moments.add(start + random.uniform(-1, 1) * along + random.normal3(sigma),
                  1 / (sigma * sigma));
    }
    const auto fit = *moments.fit_line(1.0);
    const Matrix32d B = Plane::tangent_basis(fit.direction);
    const Eigen::Vector3d truth = fit.direction.dot(along) < 0 ? Eigen::Vector3d(-along) : along;
    Eigen::VectorXd error(4);
    error << B.transpose() * truth, B.transpose() * (start - moments.mean());
    // Where the true line passes the plane through the mean that is normal to the fitted one.
    const double s = (moments.mean() - start).dot(fit.direction) / truth.dot(fit.direction);
    error.tail<2>() = B.transpose() * (start + s * truth - moments.mean());
    return ErrorAndCovariance{error, fit.covariance};
  };
  EXPECT_TRUE(is_consistent(draw, 1500));
}

// What points share does not average out: with a floor, ten thousand points are as good as it.
TEST(Moments, DiscountedKeepsWhatTheFloorLeaves) {
  Random random(12);
  const Plane truth = random.plane(2);
  const Points points = random.points_on(truth, {2, 1, 0}, 1.0, 10000, 0.01);
  const Moments moments = moments_of(points, 1e4);
  const NoiseFloor floor{0.003, 0.002};
  const Moments kept = moments.discounted(truth.normal(), floor);
  EXPECT_NEAR(1 / kept.weight(), 1 / moments.weight() + 9e-6, 1e-12);
  const Matrix32d B = truth.tangent_basis();
  const Eigen::Matrix2d before = (B.transpose() * moments.scatter() * B).inverse();
  const Eigen::Matrix2d after = (B.transpose() * kept.scatter() * B).inverse();
  EXPECT_THAT(after, IsNear(Eigen::Matrix2d(before + 4e-6 * Eigen::Matrix2d::Identity()), 1e-12));
  // No constant is left: the plane through the mean with this normal costs nothing.
  EXPECT_NEAR(kept.cost(Plane(truth.normal(), truth.normal().dot(kept.mean()))), 0, 1e-9);
  EXPECT_EQ(kept.count(), moments.count());
}

TEST(Moments, DiscountedByNothingIsAllOfItButTheConstant) {
  Random random(13);
  const Plane truth = random.plane(2);
  const Moments moments = moments_of(random.points_on(truth, {2, 1, 0}, 1.0, 100, 0.01), 1e4);
  const Plane best = moments.fit_plane({9, 9, 9})->plane;
  const Moments kept = moments.discounted(best.normal(), {});
  const double constant = moments.cost(best);
  for (int i = 0; i < 20; ++i) {
    // To second order in the tilt: the normal's own scatter is what is left out.
    const Plane other = best.boxplus(1e-4 * random.normal3());
    EXPECT_NEAR(kept.cost(other), moments.cost(other) - constant, 1e-6 * moments.cost(other));
  }
}

TEST(Moments, DiscountedSegmentSaysNothingOfTheOtherTilt) {
  Moments segment;
  for (int i = 0; i < 50; ++i) segment.add({2, 0.02 * i, 0}, 1e4);
  const Eigen::Vector3d normal(-1, 0, 0);
  const Moments kept = segment.discounted(normal, {0.002, 0.001});
  const Plane plane(normal, normal.dot(kept.mean()));
  // Turned about the segment itself (the y axis through its mean) it still costs nothing.
  const Eigen::Vector3d tilted = SO3::rot_y(0.3) * normal;
  EXPECT_NEAR(kept.cost(Plane(tilted, tilted.dot(kept.mean()))), 0, 1e-9);
  const Eigen::Vector3d turned = SO3::rot_z(0.01) * normal;
  // 50 points over 1 m with sigma 1 cm know the turn to 4.9 mrad, and the floor adds 1 mrad.
  EXPECT_NEAR(kept.cost(Plane(turned, turned.dot(kept.mean()))), 1e-4 / (4.9e-3 * 4.9e-3 + 1e-6),
              0.05);
}

// The claim behind discounted(): errors shared by all points, drawn with the floor's sigmas, leave
// estimates that are as sure as the discounted moments say.
TEST(Moments, DiscountedIsConsistentUnderSharedErrors) {
  const Plane truth({0.3, -0.2, 0.9}, 1.2);
  const double sigma = 0.01;
  const NoiseFloor floor{0.004, 0.003};
  const auto draw = [&](Random& random) {
    const Points points = random.points_on(truth, {2, 1, 0}, 1.0, 400, sigma);
    const Eigen::Vector3d centre = moments_of(points).mean();
    const Eigen::Vector3d shared(random.normal(floor.sigma_tilt), random.normal(floor.sigma_tilt),
                                 random.normal(floor.sigma_rho));
    const Plane shifted = truth.about(centre).boxplus(shared);
    Moments moments;
    for (const auto& point : points) {
      // The point where the shifted plane has it: same place in the plane, same own noise.
      const Eigen::Vector3d x = point - centre;
      const double own = truth.about(centre).signed_distance(x);
      moments.add(centre + shifted.project(x) + own * shifted.normal(), 1 / (sigma * sigma));
    }
    const PlaneFit fit = *moments.fit_plane(centre + truth.normal(), 1.0);
    const Moments kept = moments.discounted(fit.plane.normal(), floor);
    const Matrix32d B = fit.plane.tangent_basis();
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    covariance.topLeftCorner<2, 2>() = (B.transpose() * kept.scatter() * B).inverse();
    covariance(2, 2) = 1 / kept.weight();
    return ErrorAndCovariance{truth.about(kept.mean()).boxminus(fit.plane.about(kept.mean())),
                              covariance};
  };
  EXPECT_TRUE(is_consistent(draw, 400));
}

// A strip of wall, 4 m long and 0.6 m high, whose image is bent slowly: its middle, and its ends
// along each axis, are off by as much. It leans by far more than it turns.
TEST(Moments, DiscountedIsConsistentUnderABend) {
  constexpr double kSigma = 0.005, kBend = 0.006;
  const Plane wall({-1, 0, 0}, -3);
  NoiseFloor floor;
  floor.sigma_rho = floor.sigma_bend = kBend;
  double long_sigma = 0, short_sigma = 0;
  const auto draw = [&](Random& random) {
    const double off = random.normal(kBend), turn = random.normal(kBend),
                 lean = random.normal(kBend);
    const double long_rms = 4 / std::sqrt(12.0), short_rms = 0.6 / std::sqrt(12.0);
    Moments moments;
    for (int i = 0; i < 40; ++i) {
      for (int j = 0; j < 10; ++j) {
        const double y = 0.1 * (i - 19.5), z = 0.06 * (j - 4.5);
        const double x = 3 + off + turn * y / long_rms + lean * z / short_rms;
        moments.add({x + random.normal(kSigma), y, z}, 1 / (kSigma * kSigma));
      }
    }
    const PlaneFit fit = *moments.fit_plane(Eigen::Vector3d::Zero(), 1.0);
    const Moments kept = moments.discounted(fit.plane.normal(), floor);
    const Matrix32d B = fit.plane.tangent_basis();
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    covariance.topLeftCorner<2, 2>() = (B.transpose() * kept.scatter() * B).inverse();
    covariance(2, 2) = 1 / kept.weight();
    const Eigen::Vector2d sigmas =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance.topLeftCorner<2, 2>())
            .eigenvalues()
            .cwiseSqrt();
    long_sigma = sigmas(0);
    short_sigma = sigmas(1);
    return ErrorAndCovariance{wall.about(kept.mean()).boxminus(fit.plane.about(kept.mean())),
                              covariance};
  };
  EXPECT_TRUE(is_consistent(draw, 400));
  EXPECT_NEAR(short_sigma / long_sigma, 4 / 0.6, 0.3);
}

}  // namespace
}  // namespace lamina::test
