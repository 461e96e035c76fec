// Cholesky factor of a symmetric matrix of small blocks: ordered by blocks, filled in place.
//
// CHOLMOD (SuiteSparse) does the numbers; this class orders blocks instead of scalars, and lets
// whoever assembles add straight into the ordered matrix, so that no copy is made between.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace lamina {

/// Where the block of two variables lies: entry (r, c) of it at values[base + c * stride + r]. When
/// `transposed`, (r, c) are those of the second variable by the first.
struct BlockSlot {
  double* base = nullptr;
  int stride = 0;
  bool transposed = false;

  /// Adds J_a^T J_b, the block of (a, b); the slot was asked for with the same order.
  template <class Ja, class Jb>
  void add(const Ja& a, const Jb& b) const {
    constexpr int rows = Ja::ColsAtCompileTime, cols = Jb::ColsAtCompileTime;
    if (transposed) {
      target<cols, rows>() += b.transpose() * a;
    } else {
      target<rows, cols>() += a.transpose() * b;
    }
  }
  /// Adds a block of (a, b) of any size.
  void add_block(const Eigen::MatrixXd& block) const;

 private:
  /// The block as it lies in its columns; Eigen stores a single row by rows.
  template <int rows, int cols>
  auto target() const {
    using Stride = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
    constexpr int order = rows == 1 && cols > 1 ? Eigen::RowMajor : Eigen::ColMajor;
    using Block = Eigen::Matrix<double, rows, cols, order>;
    const Stride strides = order == Eigen::RowMajor ? Stride(1, stride) : Stride(stride, 1);
    return Eigen::Map<Block, 0, Stride>(base, strides);
  }
};

class BlockCholesky {
 public:
  /// `sizes`: rows of each variable; `pairs`: variables (a, b), a != b, whose block may be filled.
  /// Repeated pairs are allowed. Orders by approximate minimum degree on blocks.
  BlockCholesky(std::vector<int> sizes, std::vector<std::pair<int, int>> pairs);
  ~BlockCholesky();
  BlockCholesky(BlockCholesky&&) noexcept;
  BlockCholesky& operator=(BlockCholesky&&) noexcept;

  int dimension() const;
  /// First row of a variable in the right-hand side (in the caller's order of variables).
  int row_of(int variable) const;
  /// Slot of (a, b), or of the diagonal block when a == b. Searches: ask once, keep.
  BlockSlot slot(int a, int b);

  void set_zero();
  /// Diagonal in the caller's order.
  Eigen::VectorXd diagonal() const;
  /// Factors values + diag(added); `added` in the caller's order. False when that is not positive
  /// definite. The values themselves are kept.
  bool factorize(const Eigen::VectorXd& added);
  /// x with (values + diag(added)) x = b, of the last good factorize().
  Eigen::VectorXd solve(const Eigen::VectorXd& b);
  /// Smallest pivot of the last factor relative to the diagonal entry it started from, and how many
  /// lie below `threshold`: directions that nothing constrains.
  int weak_pivots(double threshold) const;
  /// Blocks (v, v) of the inverse for each variable asked for.
  std::vector<Eigen::MatrixXd> inverse_blocks(std::span<const int> variables);
  /// The inverse over all variables asked for, stacked in their order, cross terms included.
  Eigen::MatrixXd inverse_of(std::span<const int> variables);
  /// The same over each pair of variables.
  std::vector<Eigen::MatrixXd> inverse_of_pairs(std::span<const std::pair<int, int>> pairs);
  /// Entries of the factor, and floating point operations it takes (as the ordering predicts).
  double factor_entries() const;
  double factor_flops() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lamina
