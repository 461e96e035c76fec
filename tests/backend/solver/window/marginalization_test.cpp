// Marginalisation against the dense Schur complement, and what must stay free.
#include <lamina/backend/solver/window/marginalization.hpp>

#include <gtest/gtest.h>

#include <random>

namespace lamina {
namespace {

Eigen::MatrixXd random_matrix(std::mt19937& rng, int rows, int cols) {
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return normal(rng); });
}

LinearFactor random_factor(std::mt19937& rng, std::vector<int> variables,
                           const std::vector<int>& sizes, int rows) {
  LinearFactor factor;
  factor.variables = variables;
  for (int v : variables) factor.jacobians.push_back(random_matrix(rng, rows, sizes[v]));
  factor.residual = random_matrix(rng, rows, 1);
  return factor;
}

TEST(EliminationOrder, EliminatedFirstThenTheirNeighboursInOrder) {
  std::mt19937 rng(1);
  const std::vector<int> sizes{6, 6, 3, 3, 3};
  const std::vector<LinearFactor> factors{
      random_factor(rng, {0, 1}, sizes, 6), random_factor(rng, {0, 3}, sizes, 4),
      random_factor(rng, {1, 4}, sizes, 4), random_factor(rng, {1, 2}, sizes, 4)};
  const std::vector<int> gone{3, 0, 3};
  const std::vector<LinearFactor> used{factors[0], factors[1]};
  const auto order = elimination_order(sizes, gone, used);
  EXPECT_EQ(order.variables, (std::vector<int>{0, 3, 1}));
  EXPECT_EQ(order.column, (std::vector<int>{0, 9, -1, 6, -1}));
  EXPECT_EQ(order.eliminated_columns, 9);
  EXPECT_EQ(order.kept_columns, 6);
  EXPECT_EQ(factors_to_eliminate(gone, factors), (std::vector<std::size_t>{0, 1}));
}

TEST(LinearSystem, StacksRowsAndAddsRepeatedVariables) {
  LinearFactor factor;
  factor.variables = {0, 1, 0};
  factor.jacobians = {Eigen::MatrixXd::Constant(1, 1, 2.0), Eigen::MatrixXd::Constant(1, 2, 3.0),
                      Eigen::MatrixXd::Constant(1, 1, 5.0)};
  factor.residual = Eigen::VectorXd::Constant(1, 7.0);
  const std::vector<int> sizes{1, 2}, gone{1};
  const std::vector<LinearFactor> factors{factor};
  const auto system = linear_system(elimination_order(sizes, gone, factors), factors);
  EXPECT_EQ(system.J, (Eigen::MatrixXd(1, 3) << 3.0, 3.0, 7.0).finished());
  EXPECT_EQ(system.r(0), 7.0);
  EXPECT_EQ(system.eliminated_columns, 2);
}

TEST(EliminateByQr, EqualsTheDenseSchurComplement) {
  std::mt19937 rng(2);
  for (int trial = 0; trial < 50; ++trial) {
    LinearSystem system;
    system.eliminated_columns = 1 + trial % 9;
    const int kept = 1 + trial % 17;
    system.J = random_matrix(rng, system.eliminated_columns + kept + trial % 5,
                             system.eliminated_columns + kept);
    system.r = random_matrix(rng, int(system.J.rows()), 1);
    const auto root = eliminate_by_qr(system);
    const auto dense = eliminate_by_schur(system);
    EXPECT_TRUE((root.R.transpose() * root.R).isApprox(dense.H, 1e-9)) << "seed 2, " << trial;
    EXPECT_LT((root.R.transpose() * root.r - dense.b).norm(), 1e-8 * (1 + dense.b.norm()));
    EXPECT_EQ(root.eliminated_rank, system.eliminated_columns);
    EXPECT_TRUE(root.R.isUpperTriangular(1e-12));
  }
}

// More columns than one panel, over a triangle as priors are and rows that begin anywhere.
TEST(EliminateByQr, RowsUponATriangleFromBeforeEqualTheSchurComplement) {
  std::mt19937 rng(7);
  const int gone = 6, kept = 55;
  LinearSystem system;
  system.eliminated_columns = gone;
  system.J = random_matrix(rng, gone + kept + 40, gone + kept);
  for (int i = 0; i < gone + kept; ++i) system.J.row(i).head(i).setZero();
  for (int i = 0; i < 30; ++i) system.J.row(gone + kept + i).head(2 * i).setZero();
  system.J.row(20).setZero();
  system.r = random_matrix(rng, gone + kept + 40, 1);
  const SquareRootInformation root = eliminate_by_qr(system);
  const DenseInformation dense = eliminate_by_schur(system);
  EXPECT_TRUE(root.R.isUpperTriangular());
  EXPECT_TRUE(gram(root.R).isApprox(dense.H, 1e-9));
  EXPECT_TRUE((root.R.transpose() * root.r).isApprox(dense.b, 1e-9));
}

TEST(Gram, IsTheProductWhateverTheShape) {
  std::mt19937 rng(8);
  for (const int rows : {0, 1, 20, 50, 70}) {
    Eigen::MatrixXd R = random_matrix(rng, rows, 50);
    EXPECT_TRUE(gram(R).isApprox(R.transpose() * R, 1e-13)) << rows;
    R.triangularView<Eigen::StrictlyLower>().setZero();
    EXPECT_TRUE(gram(R).isApprox(R.transpose() * R, 1e-13)) << rows;
    if (rows < 50) continue;
    R(49, 47) = 3;  // as a plane's new anchor leaves it
    EXPECT_TRUE(gram(R).isApprox(R.transpose() * R, 1e-13)) << rows;
  }
}

TEST(EliminateByQr, KeepsTheConstantOfTheCost) {
  std::mt19937 rng(3);
  LinearSystem system{random_matrix(rng, 20, 9), random_matrix(rng, 20, 1), 4};
  const auto root = eliminate_by_qr(system);
  const Eigen::VectorXd best = system.J.colPivHouseholderQr().solve(-system.r);
  const double least = (system.J * best + system.r).squaredNorm();
  EXPECT_NEAR((root.R * best.tail(5) + root.r).squaredNorm() + root.constant, least, 1e-10);
}

TEST(EliminateByQr, AnEliminatedDirectionWithoutEvidenceCarriesNothingOver) {
  std::mt19937 rng(4);
  LinearSystem system{random_matrix(rng, 12, 8), random_matrix(rng, 12, 1), 4};
  system.J.col(1).setZero();
  system.J.col(3) = 2.0 * system.J.col(2);  // two columns that cannot be told apart
  const auto root = eliminate_by_qr(system);
  const auto dense = eliminate_by_schur(system);
  EXPECT_EQ(root.eliminated_rank, 2);
  EXPECT_TRUE((root.R.transpose() * root.R).isApprox(dense.H, 1e-9));
}

// A chain of points on a line, tied by differences only: its position is free before and after.
TEST(EliminateByQr, TheGaugeStaysFree) {
  const std::vector<int> sizes{1, 1, 1, 1};
  std::vector<LinearFactor> factors;
  for (int i = 0; i + 1 < 4; ++i) {
    LinearFactor f;
    f.variables = {i, i + 1};
    f.jacobians = {Eigen::MatrixXd::Constant(1, 1, -1.0), Eigen::MatrixXd::Constant(1, 1, 1.0)};
    f.residual = Eigen::VectorXd::Constant(1, 0.5);
    factors.push_back(f);
  }
  const std::vector<int> gone{1, 2};
  const auto system = linear_system(elimination_order(sizes, gone, factors), factors);
  const auto root = eliminate_by_qr(system);
  ASSERT_EQ(root.R.rows(), 1);
  EXPECT_NEAR((root.R * Eigen::Vector2d(1, 1)).norm(), 0, 1e-12);
  EXPECT_NEAR((root.R * Eigen::Vector2d(0, 1)).squaredNorm(), 1.0 / 3.0, 1e-12);
}

TEST(EliminateByQr, NothingKeptNothingEliminatedNoRows) {
  LinearSystem none{Eigen::MatrixXd(0, 3), Eigen::VectorXd(0), 1};
  EXPECT_EQ(eliminate_by_qr(none).R.rows(), 0);
  EXPECT_EQ(eliminate_by_qr(none).R.cols(), 2);
  LinearSystem all{Eigen::MatrixXd::Identity(3, 3), Eigen::VectorXd::Ones(3), 3};
  EXPECT_EQ(eliminate_by_qr(all).R.rows(), 0);
  LinearSystem kept{Eigen::MatrixXd::Identity(3, 3), Eigen::VectorXd::Ones(3), 0};
  EXPECT_TRUE((eliminate_by_qr(kept).R.cwiseAbs()).isApprox(Eigen::MatrixXd::Identity(3, 3)));
}

TEST(EliminateByQr, WhatIsNotFiniteGivesNoInformation) {
  LinearSystem bad{Eigen::MatrixXd::Identity(3, 3), Eigen::VectorXd::Ones(3), 1};
  bad.J(1, 1) = std::nan("");
  const auto root = eliminate_by_qr(bad);
  EXPECT_EQ(root.R.rows(), 0);
  EXPECT_TRUE(std::isinf(root.constant));
}

// Squaring 1e-9 loses it beside 1; orthogonal transformations keep it.
TEST(EliminateByQr, KeepsInformationThatSquaringLoses) {
  LinearSystem system{Eigen::MatrixXd(3, 2), Eigen::VectorXd::Zero(3), 1};
  system.J << 1.0, 1.0, 1e-9, 0.0, 0.0, 1e-9;
  const auto root = eliminate_by_qr(system);
  // min over x of (x + y)^2 + 1e-18 x^2 + 1e-18 y^2 = 2e-18 y^2 to first order.
  ASSERT_EQ(root.R.rows(), 1);
  EXPECT_NEAR(std::abs(root.R(0, 0)), std::sqrt(2.0) * 1e-9, 1e-14);
}

}  // namespace
}  // namespace lamina
