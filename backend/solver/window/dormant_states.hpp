// What left a window, jointly Gaussian given what stays: nothing is lost by leaving.
//
// A marginal prior alone forgets how the states that left hang together with those that stay. Kept
// as variables they would cost a factorisation each step. Here they are kept given the states of
// the prior (the interface, A), as compressed filters keep the map beside them [Guivant2001]:
//
//   x = offset + gain d_A + w,  w ~ N(0, covariance),
//
// x and d_A steps in tangent spaces. A step of the window costs nothing, an elimination rank-k
// updates, and a state that comes back is the same as if it had stayed.
#pragma once

#include <Eigen/Core>
#include <optional>

#include <lamina/backend/solver/window/marginalization.hpp>

namespace lamina {

class StatesBehind {
 public:
  /// `block` states belong together and come and go as one.
  explicit StatesBehind(Eigen::Index block = 3) : block_(block) {}
  Eigen::Index size() const { return offset_.size(); }
  /// Of all of x where the interface has moved by `step`.
  Eigen::VectorXd mean(const Eigen::VectorXd& step) const;
  const Eigen::MatrixXd& gain() const { return gain_; }
  /// Symmetric, given the interface.
  Eigen::MatrixXd covariance() const;

  /// States leave the interface. `step`: how far the interface has moved since the last change;
  /// steps count from there again. `gain`: of x and then of the states that come to it, over the
  /// columns of the elimination, eliminated ones first (rows of newcomers select their own).
  void eliminate(const Eigen::VectorXd& step, Eigen::MatrixXd gain, const Conditional& eliminated);
  /// Forgets the block from `row` on; the last block takes its rows. Exact: the others'
  /// distribution stays.
  void drop(Eigen::Index row);
  /// The block from `row` on becomes columns of the interface, its last; the last block takes its
  /// rows. Gives what ties it to the others: |S (x_i - offset - gain d_A)|^2, as a prior's rows
  /// over [d_A x_i] and their residual. nullopt, and nothing changes: no covariance of full rank.
  std::optional<SquareRootInformation> take(Eigen::Index row);
  /// The interface's states `column` .. + M.rows() are measured otherwise: d_old = M d_new.
  void change_columns(Eigen::Index column, const Eigen::MatrixXd& M);
  void clear() { *this = StatesBehind(block_); }

 private:
  Eigen::Index block_;
  Eigen::VectorXd offset_;
  Eigen::MatrixXd gain_;
  Eigen::MatrixXd covariance_;  // the lower triangle of the first size() counts; the rest is room
};

}  // namespace lamina
