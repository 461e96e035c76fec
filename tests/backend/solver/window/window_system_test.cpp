// The window's own Cholesky against a dense one.
#include <lamina/backend/solver/window/window_system.hpp>

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace lamina {
namespace {

// Adds the same random factors to the system and to a dense twin.
struct Twin {
  explicit Twin(int poses, int planes, unsigned seed) : rng(seed) {
    system.reset(poses, planes);
    H = Eigen::MatrixXd::Zero(system.columns(), system.columns());
    g = Eigen::VectorXd::Zero(system.columns());
  }
  template <int R, int C>
  Eigen::Matrix<double, R, C> random() {
    return Eigen::Matrix<double, R, C>::NullaryExpr([&] { return normal(rng); });
  }
  void dense(int a, const Eigen::MatrixXd& Ja, int b, const Eigen::MatrixXd& Jb,
             const Eigen::VectorXd& r) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(r.size(), system.columns());
    J.middleCols(a, Ja.cols()) += Ja;
    if (b >= 0) J.middleCols(b, Jb.cols()) += Jb;
    H += J.transpose() * J;
    g += J.transpose() * r;
  }
  void pose_pose(int a, int b) {
    const Eigen::Matrix<double, 6, 6> Ja = random<6, 6>(), Jb = random<6, 6>();
    const Eigen::Matrix<double, 6, 1> r = random<6, 1>();
    system.add_pose_pose(a, b, Ja, Jb, r);
    dense(6 * a, Ja, 6 * b, Jb, r);
  }
  void pose_plane(int a, int b) {
    const Eigen::Matrix<double, 4, 6> Ja = random<4, 6>();
    const Eigen::Matrix<double, 4, 3> Jb = random<4, 3>();
    const Eigen::Vector4d r = random<4, 1>();
    system.add_pose_plane(a, b, Ja, Jb, r);
    dense(6 * a, Ja, system.plane_column(b), Jb, r);
  }
  WindowSystem system;
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  std::mt19937 rng;
  std::normal_distribution<double> normal;
};

TEST(WindowSystem, StepAndCovarianceEqualTheDenseOnes) {
  Twin twin(7, 5, 3);
  for (int i = 0; i + 1 < 7; ++i) twin.pose_pose(i, i + 1);
  twin.pose_pose(1, 5);  // a loop widens the band
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 5; j += 1 + i % 2) twin.pose_plane(i, j);
  }
  // A dense prior over pose 0, planes 1 and 4.
  std::vector<int> columns{0, 1, 2, 3, 4, 5};
  for (int plane : {1, 4}) {
    for (int k = 0; k < 3; ++k) columns.push_back(twin.system.plane_column(plane) + k);
  }
  const Eigen::Matrix<double, 12, 12> R = twin.random<12, 12>();
  const Eigen::Matrix<double, 12, 1> r = twin.random<12, 1>();
  twin.system.add_dense(columns, R.transpose() * R, R.transpose() * r);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(12, twin.system.columns());
  for (int k = 0; k < 12; ++k) J.col(columns[static_cast<std::size_t>(k)]) = R.col(k);
  twin.H += J.transpose() * J;
  twin.g += J.transpose() * r;
  twin.system.add_plane(2, Eigen::Matrix3d::Identity() * 2, Eigen::Vector3d(1, 2, 3));
  twin.dense(twin.system.plane_column(2), Eigen::Matrix3d::Identity() * 2, -1, {},
             Eigen::Vector3d(1, 2, 3));

  ASSERT_TRUE(twin.system.factor());
  EXPECT_EQ(twin.system.held(), 0);
  const Eigen::VectorXd expected = twin.H.ldlt().solve(-twin.g);
  EXPECT_LT((twin.system.step() - expected).norm(), 1e-9 * expected.norm());
  const int n = twin.system.columns();
  const Eigen::MatrixXd C = twin.system.solve(Eigen::MatrixXd::Identity(n, n));
  EXPECT_TRUE((C * twin.H).isApprox(Eigen::MatrixXd::Identity(n, n), 1e-7));
  const WindowSystem::Blocks blocks = twin.system.inverse_blocks();
  ASSERT_EQ(blocks.poses.size(), 7u);
  ASSERT_EQ(blocks.planes.size(), 5u);
  for (int i = 0; i < 7; ++i) {
    const Eigen::MatrixXd block = C.block(6 * i, 6 * i, 6, 6);
    EXPECT_LT((blocks.poses[std::size_t(i)] - block).norm(), 1e-9 * block.norm());
  }
  for (int j = 0; j < 5; ++j) {
    const int at = twin.system.plane_column(j);
    const Eigen::MatrixXd block = C.block(at, at, 3, 3);
    EXPECT_LT((blocks.planes[std::size_t(j)] - block).norm(), 1e-9 * block.norm());
  }

  ASSERT_TRUE(twin.system.factor(0.5));
  Eigen::MatrixXd damped = twin.H;
  damped.diagonal() *= 1.5;
  const Eigen::VectorXd damped_step = damped.ldlt().solve(-twin.g);
  EXPECT_LT((twin.system.step() - damped_step).norm(), 1e-9 * damped_step.norm());
}

TEST(WindowSystem, DirectionsWithoutEvidenceAreHeld) {
  Twin twin(2, 2, 4);
  twin.pose_pose(0, 1);
  twin.system.add_pose(0, Eigen::Matrix<double, 6, 6>::Identity(),
                       Eigen::Matrix<double, 6, 1>::Ones());
  twin.pose_plane(0, 0);
  // Plane 1 was never seen, plane 0 by one view of rank 3 beside a pose that has its own prior.
  ASSERT_TRUE(twin.system.factor());
  EXPECT_EQ(twin.system.held(), 3);
  const Eigen::VectorXd d = twin.system.step();
  EXPECT_TRUE(d.allFinite());
  EXPECT_LT(d.tail<3>().norm(), 1e-100);
  const WindowSystem::Blocks blocks = twin.system.inverse_blocks();
  EXPECT_LT(blocks.planes[1].norm(), 1e-100);
  EXPECT_GT(blocks.planes[0].norm(), 1e-3);
  EXPECT_TRUE(blocks.poses[0].allFinite() && blocks.poses[1].allFinite());
}

TEST(WindowSystem, NotFiniteIsReported) {
  Twin twin(1, 0, 5);
  twin.system.add_pose(0, Eigen::Matrix<double, 6, 6>::Identity(),
                       Eigen::Matrix<double, 6, 1>::Constant(std::nan("")));
  EXPECT_FALSE(twin.system.factor());
}

}  // namespace
}  // namespace lamina
