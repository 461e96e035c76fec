// Marginalisation in square-root form: elimination order -> linearise -> QR -> prior.
//
// Each step is a function of plain matrices. The sliding window calls them in this order; the tests
// hold each against the dense Schur complement.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace lamina {

/// One whitened factor at its linearisation point: the cost |sum_k jacobians[k] d_k + residual|^2,
/// d_k the step of variable variables[k] in its own tangent space.
struct LinearFactor {
  std::vector<int> variables;              ///< positions in the caller's list of variables
  std::vector<Eigen::MatrixXd> jacobians;  ///< rows of the residual x tangent size of the variable
  Eigen::VectorXd residual;
};

/// Which column each variable starts at, eliminated variables first.
struct EliminationOrder {
  std::vector<int> variables;  ///< positions in the caller's list: eliminated, then kept
  std::vector<int> column;     ///< by position in the caller's list; -1: not part of the system
  int eliminated_columns = 0;
  int kept_columns = 0;
  int columns() const { return eliminated_columns + kept_columns; }
};

/// Step 1. Eliminated variables first, then, in the caller's order, the others of `factors`: those
/// that will be used up (factors_to_eliminate(), and a prior from before). Variables that no factor
/// names take no part. `sizes` are tangent sizes of all variables; `eliminated` positions in that
/// list (repeats are ignored).
EliminationOrder elimination_order(std::span<const int> sizes, std::span<const int> eliminated,
                                   std::span<const LinearFactor> factors);

/// The factors that touch an eliminated variable: the only ones a marginalisation may use up.
std::vector<std::size_t> factors_to_eliminate(std::span<const int> eliminated,
                                              std::span<const LinearFactor> factors);

/// |J d + r|^2 with the columns of an EliminationOrder.
struct LinearSystem {
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
  int eliminated_columns = 0;
};

/// Step 2. Stacks the rows of the factors; every variable of theirs must be part of the order.
LinearSystem linear_system(const EliminationOrder& order, std::span<const LinearFactor> factors);

/// Eliminated states given the kept ones: d_gone = offset + gain d_kept + root nu, nu ~ N(0, I).
struct Conditional {
  Eigen::VectorXd offset;
  Eigen::MatrixXd gain, root;
};

/// The cost left for the kept variables: |R d + r|^2 + constant. R is upper trapezoidal with no
/// more rows than columns and no zero rows: directions that no row constrains stay free.
struct SquareRootInformation {
  Eigen::MatrixXd R;
  Eigen::VectorXd r;
  double constant = 0;      ///< chi-squared that stays whatever the kept variables do
  int eliminated_rank = 0;  ///< less than the eliminated columns where evidence does not fix them
  std::optional<Conditional> eliminated;  ///< what was taken out; nullopt: evidence does not fix it
};

/// Step 3. Minimises over the eliminated columns by QR with column pivoting, which is right for
/// eliminated directions without evidence too (they carry nothing over), then compresses what is
/// left to a triangle by a second QR. Numbers below `tolerance` times the largest column norm of a
/// pivot count as zero. Information is never formed as J^T J, so none is lost by squaring.
/// A system with anything not finite gives an empty R (no rows) and an infinite constant.
SquareRootInformation eliminate_by_qr(const LinearSystem& system, double tolerance = 1e-12);

/// R^T R, at a third of the cost where R is a triangle.
Eigen::MatrixXd gram(const Eigen::MatrixXd& R);

/// The same by the dense Schur complement of J^T J: H = Hkk - Hke Hee^+ Hek and b likewise. For
/// tests and comparison; it loses half of the digits.
struct DenseInformation {
  Eigen::MatrixXd H;
  Eigen::VectorXd b;  ///< gradient: the cost is d^T H d + 2 b^T d + constant
};
DenseInformation eliminate_by_schur(const LinearSystem& system);

}  // namespace lamina
