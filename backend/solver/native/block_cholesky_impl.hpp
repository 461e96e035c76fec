// What is behind BlockCholesky. Internal: includes CHOLMOD.
#pragma once

#include <cholmod.h>

#include <vector>

#include <lamina/backend/solver/native/block_cholesky.hpp>

namespace lamina {
namespace detail {

/// cholmod_common that prints nothing.
struct Common {
  cholmod_common c;
  Common() {
    cholmod_start(&c);
    c.print = 0;
    c.error_handler = nullptr;
  }
  ~Common() { cholmod_finish(&c); }
  Common(const Common&) = delete;
  Common& operator=(const Common&) = delete;
};

/// Lower triangle of the pattern of variables, by columns.
struct Pattern {
  std::vector<int> starts, rows;
};

/// A CHOLMOD matrix over arrays it does not own: the lower triangle, columns sorted.
cholmod_sparse lower_view(int n, std::vector<int>& starts, std::vector<int>& rows, double* values);

}  // namespace detail

struct BlockCholesky::Impl {
  detail::Common common;
  std::vector<int> sizes;         ///< of variables, caller's order
  std::vector<int> first_row;     ///< of variables, caller's order
  std::vector<int> position;      ///< of a variable in the elimination order
  std::vector<int> order;         ///< variable at a position
  std::vector<int> ordered_row;   ///< first row of a variable in the ordered matrix
  detail::Pattern blocks;         ///< by positions; the diagonal first in each column
  std::vector<int> block_offset;  ///< offset of a block's first row within its column
  std::vector<int> starts, rows;  ///< scalar columns of the ordered matrix
  std::vector<double> values;
  std::vector<double> damped;               ///< values + diagonal, what is factored
  std::vector<std::size_t> diagonal_place;  ///< of row i (caller's order) in values
  int n = 0;
  cholmod_factor* L = nullptr;
  Eigen::VectorXd factored_diagonal;  ///< ordered, of what was factored last

  ~Impl() { cholmod_free_factor(&L, &common.c); }
  void order_blocks(const std::vector<std::pair<int, int>>& pairs);
  void number_rows();
  void lay_out();
  void analyze();
  template <class F>
  void each_pivot(F&& f) const;
  cholmod_sparse matrix(std::vector<double>& x) {
    return detail::lower_view(n, starts, rows, x.data());
  }
};

}  // namespace lamina
