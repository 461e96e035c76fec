// What right angles tell of the bend.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <random>

#include <lamina/pipeline/calibration/camera/plane_angles.hpp>

namespace lamina {
namespace {

constexpr int kTerms = 6;

Eigen::VectorXd random_vector(std::mt19937_64& random, int size, double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  Eigen::VectorXd v(size);
  for (double& x : v) x = normal(random);
  return v;
}

// Three planes square to each other, turned by chance, as a camera with that bend sees them.
std::vector<ImagePlane> corner(std::mt19937_64& random, const Eigen::VectorXd& bend) {
  const Eigen::Matrix3d R =
      Eigen::Quaterniond(Eigen::Vector4d(random_vector(random, 4, 1))).normalized().matrix();
  std::vector<ImagePlane> planes(3);
  for (int k = 0; k < 3; ++k) {
    ImagePlane& plane = planes[static_cast<std::size_t>(k)];
    plane.by_bend.resize(3, kTerms);
    for (int i = 0; i < kTerms; ++i) plane.by_bend.col(i) = random_vector(random, 3, 1);
    plane.q = 20 * R.col(k) + plane.by_bend * bend;
    plane.covariance = 0.01 * Eigen::Matrix3d::Identity();
  }
  return planes;
}

TEST(PlaneAngles, TellTheBend) {
  std::mt19937_64 random(1);
  const Eigen::VectorXd truth = random_vector(random, kTerms, 0.3);
  PlaneAngles angles;
  for (int i = 0; i < 20; ++i) angles.add(corner(random, truth));
  Eigen::VectorXd c = Eigen::VectorXd::Zero(kTerms);
  const double before = angles.cost(c);
  for (int step = 0; step < 8; ++step) {
    Eigen::MatrixXd H = 1e-9 * Eigen::MatrixXd::Identity(kTerms, kTerms);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(kTerms);
    angles.linearize(c, H, g);
    c -= H.ldlt().solve(g);
  }
  EXPECT_GT(before, 1);
  EXPECT_LT(angles.cost(c), 1e-6);
  EXPECT_LT((c - truth).norm(), 1e-3);
}

// The system's right side is half the slope of the cost, squares and parallels alike.
TEST(PlaneAngles, SlopeOfTheCost) {
  std::mt19937_64 random(2);
  const Eigen::VectorXd bend = random_vector(random, kTerms, 0.2);
  PlaneAngles angles;
  for (int i = 0; i < 3; ++i) {
    std::vector<ImagePlane> planes = corner(random, bend);
    planes.push_back(planes[0]);  // opposite
    planes.back().q *= -0.8;
    angles.add(planes);
  }
  const Eigen::VectorXd at = random_vector(random, kTerms, 0.1);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(kTerms, kTerms);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(kTerms);
  angles.linearize(at, H, g);
  for (int k = 0; k < kTerms; ++k) {
    const Eigen::VectorXd d = 1e-5 * Eigen::VectorXd::Unit(kTerms, k);
    const double slope = (angles.cost(at + d) - angles.cost(at - d)) / 2e-5;
    // Variances change a little with the normals, which the system leaves out.
    EXPECT_NEAR(g(k), 0.5 * slope, 0.05 * g.cwiseAbs().maxCoeff());
  }
}

// Five degrees, and a bend of 0.3 px turns it by one: no floor that looks tilted.
TEST(PlaneAngles, AShallowRampTellsNothing) {
  std::mt19937_64 random(4);
  std::vector<ImagePlane> planes = corner(random, Eigen::VectorXd::Zero(kTerms));
  planes.resize(2);
  for (ImagePlane& plane : planes) plane.by_bend *= 0.5;
  planes[1].q = planes[0].q + std::tan(5 * M_PI / 180) * planes[1].q;
  PlaneAngles angles;
  angles.add(planes);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(kTerms, kTerms);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(kTerms);
  angles.linearize(Eigen::VectorXd::Zero(kTerms), H, g);
  EXPECT_EQ(H.norm(), 0);
  EXPECT_EQ(g.norm(), 0);
}

TEST(PlaneAngles, WhatIsBuiltAskewTellsNothing) {
  std::mt19937_64 random(3);
  std::vector<ImagePlane> planes = corner(random, Eigen::VectorXd::Zero(kTerms));
  planes.resize(2);
  planes[1].q = planes[0].q + planes[1].q;  // at 45 degrees
  PlaneAngles angles;
  angles.add(planes);
  const Eigen::VectorXd c = Eigen::VectorXd::Zero(kTerms);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(kTerms, kTerms);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(kTerms);
  angles.linearize(c, H, g);
  EXPECT_EQ(H.norm(), 0);
  EXPECT_EQ(g.norm(), 0);
  EXPECT_GT(angles.cost(c), 0);
}

// A recording twice as long of the same walls tells no more.
TEST(PlaneAngles, ManyImagesCountAsAFew) {
  std::mt19937_64 random(4);
  const std::vector<ImagePlane> image = corner(random, Eigen::VectorXd::Constant(kTerms, 0.1));
  const Eigen::VectorXd c = Eigen::VectorXd::Zero(kTerms);
  PlaneAngles one, twenty, forty;
  one.add(image);
  for (int i = 0; i < 20; ++i) twenty.add(image);
  for (int i = 0; i < 40; ++i) forty.add(image);
  EXPECT_GT(twenty.cost(c), 2 * one.cost(c));
  EXPECT_NEAR(forty.cost(c), twenty.cost(c), 1e-9);
  EXPECT_EQ(PlaneAngles().cost(c), 0);
}

}  // namespace
}  // namespace lamina
