// Elimination by orthogonal transformations.
#include <lamina/backend/solver/window/marginalization.hpp>

#include <Eigen/Dense>
#include <limits>
#include <numeric>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

// Rows below this, relative to the largest entry, are the rounding of the rotations.
constexpr double kZeroRow = 1e-12;

}  // namespace

EliminationOrder elimination_order(std::span<const int> sizes, std::span<const int> eliminated,
                                   std::span<const LinearFactor> factors) {
  std::vector<bool> chosen(sizes.size(), false), blanket(sizes.size(), false);
  for (int v : eliminated) chosen.at(static_cast<std::size_t>(v)) = true;
  for (const auto& factor : factors) {
    for (int v : factor.variables) blanket.at(static_cast<std::size_t>(v)) = true;
  }
  EliminationOrder order;
  order.column.assign(sizes.size(), -1);
  for (const bool first : {true, false}) {
    for (std::size_t v = 0; v < sizes.size(); ++v) {
      if (chosen[v] != first || (!first && !blanket[v])) continue;
      order.variables.push_back(static_cast<int>(v));
      order.column[v] = order.columns();
      (first ? order.eliminated_columns : order.kept_columns) += sizes[v];
    }
  }
  return order;
}

std::vector<std::size_t> factors_to_eliminate(std::span<const int> eliminated,
                                              std::span<const LinearFactor> factors) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const auto& variables = factors[i].variables;
    const bool hit = std::any_of(variables.begin(), variables.end(), [&](int v) {
      return std::find(eliminated.begin(), eliminated.end(), v) != eliminated.end();
    });
    if (hit) result.push_back(i);
  }
  return result;
}

LinearSystem linear_system(const EliminationOrder& order, std::span<const LinearFactor> factors) {
  Eigen::Index rows = 0;
  for (const auto& factor : factors) rows += factor.residual.size();
  LinearSystem system;
  system.eliminated_columns = order.eliminated_columns;
  system.J = Eigen::MatrixXd::Zero(rows, order.columns());
  system.r.resize(rows);
  Eigen::Index row = 0;
  for (const auto& factor : factors) {
    const Eigen::Index n = factor.residual.size();
    system.r.segment(row, n) = factor.residual;
    for (std::size_t k = 0; k < factor.variables.size(); ++k) {
      const int column = order.column.at(static_cast<std::size_t>(factor.variables[k]));
      LAMINA_CHECK(column >= 0 && factor.jacobians[k].rows() == n);
      system.J.block(row, column, n, factor.jacobians[k].cols()) += factor.jacobians[k];
    }
    row += n;
  }
  return system;
}

namespace {

/// Columns of zeros before the first entry of each row.
std::vector<Eigen::Index> first_entries(const Eigen::MatrixXd& A) {
  std::vector<Eigen::Index> first(static_cast<std::size_t>(A.rows()));
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    Eigen::Index& begin = first[static_cast<std::size_t>(i)];
    while (begin < A.cols() && A(i, begin) == 0) ++begin;
  }
  return first;
}

/// Reflects the rest of a panel's columns by v = V(:, k), which is in rows `at` and below, and adds
/// it to the product of the panel's reflections, I - V T V^T [Schreiber1989].
void reflect_panel(Eigen::MatrixXd& R, Eigen::Index at, Eigen::Index height, Eigen::Index k,
                   Eigen::MatrixXd& V, Eigen::MatrixXd& T) {
  double tau = 0, beta = 0;
  R.col(at).segment(at, height).makeHouseholderInPlace(tau, beta);
  V(k, k) = 1;
  V.col(k).segment(k + 1, height - 1) = R.col(at).segment(at + 1, height - 1);
  const auto v = V.col(k).segment(k, height);
  for (Eigen::Index j = at + 1; j < at - k + V.cols(); ++j) {
    auto x = R.col(j).segment(at, height);
    const double share = tau * v.dot(x);
    x -= share * v;
  }
  R(at, at) = beta;
  R.col(at).segment(at + 1, height - 1).setZero();
  T(k, k) = tau;
  if (k == 0) return;
  const Eigen::VectorXd overlap = -tau * (V.block(k, 0, height, k).transpose() * v);
  T.col(k).head(k) = T.topLeftCorner(k, k).triangularView<Eigen::Upper>() * overlap;
}

/// The triangle of a QR of A, by Householder's reflections. Rows are sorted by their first entry,
/// and columns are reflected over the rows that have begun by then: a triangle among them (the
/// prior from before) costs few rows a column, not all of its own (bench/window_bench.cpp). Panels
/// of columns go together, Q = I - V T V^T over each, so that the rest is touched once a panel.
Eigen::MatrixXd triangle_of(const Eigen::MatrixXd& A) {
  constexpr Eigen::Index kPanel = 12;
  const Eigen::Index rows = A.rows(), columns = A.cols(), stop = std::min(rows, columns);
  const std::vector<Eigen::Index> first = first_entries(A);
  std::vector<Eigen::Index> order(first.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return first[static_cast<std::size_t>(a)] < first[static_cast<std::size_t>(b)];
  });
  Eigen::MatrixXd R = A(order, Eigen::all), V, T, rest;
  Eigen::Index end = 0;
  for (Eigen::Index begin = 0; begin < stop; begin += kPanel) {
    const Eigen::Index width = std::min(kPanel, stop - begin);
    const auto begun = [&](Eigen::Index column) {
      const auto row = static_cast<std::size_t>(order[static_cast<std::size_t>(end)]);
      return first[row] <= column;
    };
    V.setZero(rows - begin, width);
    T.setZero(width, width);
    for (Eigen::Index k = 0; k < width; ++k) {
      const Eigen::Index at = begin + k;
      while (end < rows && begun(at)) ++end;
      const Eigen::Index height = end - at;
      if (height >= 2) reflect_panel(R, at, height, k, V, T);  // else nothing below: tau stays 0
    }
    const Eigen::Index after = columns - begin - width, height = end - begin;
    if (after == 0 || height < 2) continue;
    const auto W = V.topRows(height);
    auto X = R.block(begin, begin + width, height, after);
    rest.noalias() = W.transpose() * X;
    rest = (T.transpose() * rest).eval();
    X.noalias() -= W * rest;
  }
  R.conservativeResize(stop, Eigen::NoChange);
  return R;
}

}  // namespace

namespace {

// From the rows that elimination uses up, U P^T d_gone + [V | r] [d_kept; 1] = nu.
Conditional conditional(const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& qr,
                        const Eigen::MatrixXd& V_r) {
  const Eigen::Index gone = V_r.rows(), kept = V_r.cols() - 1;
  const auto U = qr.matrixR().topLeftCorner(gone, gone).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd solved = qr.colsPermutation() * Eigen::MatrixXd(U.solve(V_r));
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(gone, gone);
  return {-solved.col(kept), -solved.leftCols(kept),
          qr.colsPermutation() * Eigen::MatrixXd(U.solve(identity))};
}

// The rows of a triangle [R | r] that say something of the kept columns; the rest is a constant.
void keep_rows_that_carry(const Eigen::MatrixXd& triangle, SquareRootInformation& result) {
  const Eigen::Index kept = triangle.cols() - 1;
  const double scale = kept > 0 ? triangle.leftCols(kept).cwiseAbs().maxCoeff() : 0.0;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < triangle.rows(); ++i) {
    const bool carries =
        kept > 0 && triangle.row(i).head(kept).cwiseAbs().maxCoeff() > kZeroRow * scale && i < kept;
    if (carries) {
      rows.push_back(i);
    } else {
      result.constant += triangle(i, kept) * triangle(i, kept);
    }
  }
  result.R.resize(static_cast<Eigen::Index>(rows.size()), kept);
  result.r.resize(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    result.R.row(static_cast<Eigen::Index>(i)) = triangle.row(rows[i]).head(kept);
    result.r(static_cast<Eigen::Index>(i)) = triangle(rows[i], kept);
  }
}

}  // namespace

SquareRootInformation eliminate_by_qr(const LinearSystem& system, double tolerance) {
  SquareRootInformation result;
  const Eigen::Index gone = system.eliminated_columns;
  const Eigen::Index kept = system.J.cols() - gone;
  result.R.resize(0, kept);
  if (!system.J.allFinite() || !system.r.allFinite()) {
    result.constant = std::numeric_limits<double>::infinity();
    return result;
  }
  // [J_kept | r] follows the rotations of J_eliminated; the first rank rows are then used up. Rows
  // that say nothing of what goes take no part.
  Eigen::MatrixXd rest(system.J.rows(), kept + 1);
  rest << system.J.rightCols(kept), system.r;
  std::vector<Eigen::Index> touched, untouched;
  for (Eigen::Index i = 0; i < system.J.rows(); ++i) {
    const bool touches = gone > 0 && system.J.row(i).head(gone).cwiseAbs().maxCoeff() > 0;
    (touches ? touched : untouched).push_back(i);
  }
  Eigen::MatrixXd turned = rest(touched, Eigen::all);
  if (!touched.empty()) {
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(system.J(touched, Eigen::seqN(0, gone)));
    qr.setThreshold(tolerance);
    result.eliminated_rank = static_cast<int>(qr.rank());
    turned.applyOnTheLeft(qr.householderQ().setLength(qr.nonzeroPivots()).adjoint());
    if (result.eliminated_rank == gone) result.eliminated = conditional(qr, turned.topRows(gone));
  }
  const Eigen::Index stay = turned.rows() - result.eliminated_rank;
  Eigen::MatrixXd left(stay + static_cast<Eigen::Index>(untouched.size()), kept + 1);
  left << turned.bottomRows(stay), rest(untouched, Eigen::all);
  if (left.rows() == 0) return result;
  keep_rows_that_carry(triangle_of(left), result);
  return result;
}

// In panels of columns, each over the rows down to its last entry: a triangle takes a third of what
// a full matrix does.
Eigen::MatrixXd gram(const Eigen::MatrixXd& R) {
  constexpr Eigen::Index kPanel = 24;
  Eigen::MatrixXd H(R.cols(), R.cols());
  for (Eigen::Index begin = 0; begin < R.cols(); begin += kPanel) {
    const Eigen::Index width = std::min(kPanel, R.cols() - begin), rest = R.cols() - begin;
    Eigen::Index rows = R.rows();
    while (rows > 0 && R.row(rows - 1).segment(begin, width).isZero(0)) --rows;
    H.block(begin, begin, rest, width).noalias() =
        R.block(0, begin, rows, rest).transpose() * R.block(0, begin, rows, width);
  }
  H.triangularView<Eigen::StrictlyUpper>() = H.transpose();
  return H;
}

DenseInformation eliminate_by_schur(const LinearSystem& system) {
  const Eigen::Index e = system.eliminated_columns, k = system.J.cols() - e;
  const Eigen::MatrixXd H = system.J.transpose() * system.J;
  const Eigen::VectorXd b = system.J.transpose() * system.r;
  DenseInformation result{H.bottomRightCorner(k, k), b.tail(k)};
  if (e == 0) return result;
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> Hee(H.topLeftCorner(e, e));
  result.H -= H.bottomLeftCorner(k, e) * Hee.solve(H.topRightCorner(e, k));
  result.b -= H.bottomLeftCorner(k, e) * Hee.solve(b.head(e));
  return result;
}

}  // namespace lamina
