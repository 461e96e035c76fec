// Gaussian conditionals: substitution, conditioning, forgetting.
#include <lamina/backend/solver/window/dormant_states.hpp>

#include <Eigen/Cholesky>

#include <lamina/models/error.hpp>

namespace lamina {

Eigen::VectorXd StatesBehind::mean(const Eigen::VectorXd& step) const {
  return size() == 0 ? offset_ : Eigen::VectorXd(offset_ + gain_ * step);
}

Eigen::MatrixXd StatesBehind::covariance() const {
  return covariance_.topLeftCorner(size(), size()).selfadjointView<Eigen::Lower>();
}

void StatesBehind::eliminate(const Eigen::VectorXd& step, Eigen::MatrixXd gain,
                             const Conditional& eliminated) {
  const Eigen::Index gone = eliminated.offset.size(), kept = gain.cols() - gone;
  const Eigen::Index old = size(), rows = gain.rows();
  LAMINA_CHECK(rows >= old && eliminated.gain.cols() == kept);
  Eigen::VectorXd offset = Eigen::VectorXd::Zero(rows);
  offset.head(old) = mean(step);
  offset_ = offset + gain.leftCols(gone) * eliminated.offset;
  gain_ = gain.rightCols(kept);
  gain_.noalias() += gain.leftCols(gone) * eliminated.gain;
  if (covariance_.rows() < rows) {
    const Eigen::Index room = rows + rows / 2;
    covariance_.conservativeResize(room, room);
  }
  covariance_.block(old, 0, rows - old, rows).setZero();
  covariance_.topLeftCorner(rows, rows)
      .selfadjointView<Eigen::Lower>()
      .rankUpdate(gain.leftCols(gone) * eliminated.root);
}

void StatesBehind::drop(Eigen::Index row) {
  const Eigen::Index last = size() - block_, after = row + block_, between = last - after;
  if (row < last) {
    offset_.segment(row, block_) = offset_.tail(block_);
    gain_.middleRows(row, block_) = gain_.bottomRows(block_);
    Eigen::MatrixXd& C = covariance_;
    C.block(row, 0, block_, row) = C.block(last, 0, block_, row);
    C.block(after, row, between, block_) = C.block(last, after, block_, between).transpose();
    C.block(row, row, block_, block_) = C.block(last, last, block_, block_);
  }
  offset_.conservativeResize(last);
  gain_.conservativeResize(last, Eigen::NoChange);
}

std::optional<SquareRootInformation> StatesBehind::take(Eigen::Index row) {
  const Eigen::MatrixXd own =
      covariance_.block(row, row, block_, block_).selfadjointView<Eigen::Lower>();
  const Eigen::LLT<Eigen::MatrixXd> llt(own);
  if (llt.info() != Eigen::Success) return std::nullopt;
  const Eigen::MatrixXd S = llt.matrixL().solve(Eigen::MatrixXd::Identity(block_, block_));
  if (!S.allFinite()) return std::nullopt;
  const Eigen::VectorXd offset = offset_.segment(row, block_);
  const Eigen::MatrixXd gain = gain_.middleRows(row, block_);
  SquareRootInformation tie;
  tie.R.resize(block_, gain.cols() + block_);
  tie.R << -S * gain, S;
  tie.r = -S * offset;
  // The others given these as well: K = C_rest,i C_ii^-1. The last block goes to the gap.
  const Eigen::Index last = size() - block_, after = row + block_;
  Eigen::MatrixXd cross(last, block_);
  cross.topRows(row) = covariance_.block(row, 0, block_, row).transpose();
  if (row < last) {
    cross.middleRows(row, block_) = covariance_.block(last, row, block_, block_);
    cross.bottomRows(last - after) = covariance_.block(after, row, last - after, block_);
  }
  const Eigen::MatrixXd root = cross * S.transpose(), K = root * S;
  drop(row);
  offset_ -= K * offset;
  Eigen::MatrixXd wider(last, gain.cols() + block_);
  wider << gain_ - K * gain, K;
  gain_ = std::move(wider);
  covariance_.topLeftCorner(last, last).selfadjointView<Eigen::Lower>().rankUpdate(root, -1.0);
  return tie;
}

void StatesBehind::change_columns(Eigen::Index column, const Eigen::MatrixXd& M) {
  if (size() == 0) return;
  gain_.middleCols(column, M.rows()) = (gain_.middleCols(column, M.rows()) * M).eval();
}

}  // namespace lamina
