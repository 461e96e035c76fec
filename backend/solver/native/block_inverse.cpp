// Entries of the inverse from a sparse factor: forward solves along the elimination tree alone.
//
// With A = L L^T, inverse(i, k) = y_i . y_k where L y_i = e_i; y_i is nonzero only on the path from
// i to the root of the elimination tree, which is short where the ordering is good.
#include <cholmod.h>

#include <cmath>
#include <map>

#include <lamina/backend/solver/native/block_cholesky_impl.hpp>

namespace lamina {
namespace {

struct SparseVector {
  std::vector<int> rows;
  std::vector<double> values;
};

/// Simplicial L L^T copy of a factor, freed at the end.
class SimplicialCopy {
 public:
  SimplicialCopy(const cholmod_factor* L, cholmod_common* common) : common_(common) {
    copy_ = cholmod_copy_factor(const_cast<cholmod_factor*>(L), common);
    if (copy_ != nullptr) cholmod_change_factor(CHOLMOD_REAL, 1, 0, 1, 1, copy_, common);
  }
  ~SimplicialCopy() { cholmod_free_factor(&copy_, common_); }
  SimplicialCopy(const SimplicialCopy&) = delete;
  SimplicialCopy& operator=(const SimplicialCopy&) = delete;
  bool valid() const { return copy_ != nullptr && !copy_->is_super && copy_->is_ll; }

  /// L y = e_row; `work` is all zero before and after.
  SparseVector forward(int row, std::vector<double>& work) const {
    const auto* p = static_cast<const int*>(copy_->p);
    const auto* i = static_cast<const int*>(copy_->i);
    const auto* nz = static_cast<const int*>(copy_->nz);
    const auto* x = static_cast<const double*>(copy_->x);
    SparseVector y;
    work[std::size_t(row)] = 1;
    for (int j = row; j >= 0;) {
      const double value = work[std::size_t(j)] / x[p[j]];
      work[std::size_t(j)] = 0;
      y.rows.push_back(j);
      y.values.push_back(value);
      for (int k = p[j] + 1; k < p[j] + nz[j]; ++k) work[std::size_t(i[k])] -= x[k] * value;
      // Rows of a column are sorted: the first below the diagonal is the parent.
      j = nz[j] > 1 ? i[p[j] + 1] : -1;
    }
    return y;
  }

 private:
  cholmod_common* common_;
  cholmod_factor* copy_;
};

/// Rows of both ascend: towards the root.
double dot(const SparseVector& y, const SparseVector& z) {
  double sum = 0;
  for (std::size_t a = 0, b = 0; a < y.rows.size() && b < z.rows.size();) {
    if (y.rows[a] == z.rows[b]) {
      sum += y.values[a++] * z.values[b++];
    } else if (y.rows[a] < z.rows[b]) {
      ++a;
    } else {
      ++b;
    }
  }
  return sum;
}

}  // namespace

Eigen::MatrixXd BlockCholesky::inverse_of(std::span<const int> variables) {
  Impl& s = *impl_;
  int size = 0;
  for (const int v : variables) size += s.sizes[std::size_t(v)];
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(size, size);
  if (s.n == 0 || s.L == nullptr || s.L->xtype == CHOLMOD_PATTERN) return inverse;
  const SimplicialCopy L(s.L, &s.common.c);
  if (!L.valid()) return inverse;
  std::vector<double> work(std::size_t(s.n), 0.0);
  std::vector<SparseVector> columns;
  for (const int v : variables) {
    for (int c = 0; c < s.sizes[std::size_t(v)]; ++c) {
      columns.push_back(L.forward(s.ordered_row[std::size_t(v)] + c, work));
    }
  }
  for (int a = 0; a < size; ++a) {
    const SparseVector& y = columns[std::size_t(a)];
    for (std::size_t k = 0; k < y.rows.size(); ++k) work[std::size_t(y.rows[k])] = y.values[k];
    for (int b = a; b < size; ++b) {
      const SparseVector& z = columns[std::size_t(b)];
      double sum = 0;
      for (std::size_t k = 0; k < z.rows.size(); ++k) {
        sum += z.values[k] * work[std::size_t(z.rows[k])];
      }
      inverse(a, b) = inverse(b, a) = sum;
    }
    for (const int row : y.rows) work[std::size_t(row)] = 0;
  }
  return inverse;
}

std::vector<Eigen::MatrixXd> BlockCholesky::inverse_blocks(std::span<const int> variables) {
  Impl& s = *impl_;
  std::vector<Eigen::MatrixXd> blocks;
  if (s.n == 0 || s.L == nullptr || s.L->xtype == CHOLMOD_PATTERN) return blocks;
  const SimplicialCopy L(s.L, &s.common.c);
  if (!L.valid()) return blocks;
  std::vector<double> work(std::size_t(s.n), 0.0), scattered(std::size_t(s.n), 0.0);
  for (const int v : variables) {
    const int size = s.sizes[std::size_t(v)];
    std::vector<SparseVector> columns;
    for (int c = 0; c < size; ++c) {
      columns.push_back(L.forward(s.ordered_row[std::size_t(v)] + c, work));
    }
    Eigen::MatrixXd block(size, size);
    for (int a = 0; a < size; ++a) {
      const SparseVector& y = columns[std::size_t(a)];
      for (std::size_t k = 0; k < y.rows.size(); ++k) {
        scattered[std::size_t(y.rows[k])] = y.values[k];
      }
      for (int b = a; b < size; ++b) {
        const SparseVector& z = columns[std::size_t(b)];
        double sum = 0;
        for (std::size_t k = 0; k < z.rows.size(); ++k) {
          sum += z.values[k] * scattered[std::size_t(z.rows[k])];
        }
        block(a, b) = block(b, a) = sum;
      }
      for (const int row : y.rows) scattered[std::size_t(row)] = 0;
    }
    blocks.push_back(std::move(block));
  }
  return blocks;
}

std::vector<Eigen::MatrixXd> BlockCholesky::inverse_of_pairs(
    std::span<const std::pair<int, int>> pairs) {
  Impl& s = *impl_;
  std::vector<Eigen::MatrixXd> joints;
  if (s.n == 0 || s.L == nullptr || s.L->xtype == CHOLMOD_PATTERN) return joints;
  const SimplicialCopy L(s.L, &s.common.c);
  if (!L.valid()) return joints;
  std::vector<double> work(std::size_t(s.n), 0.0);
  std::map<int, std::vector<SparseVector>> columns;
  const auto columns_of = [&](int variable) -> const std::vector<SparseVector>& {
    auto& all = columns[variable];
    const int size = s.sizes[std::size_t(variable)];
    for (int c = static_cast<int>(all.size()); c < size; ++c) {
      all.push_back(L.forward(s.ordered_row[std::size_t(variable)] + c, work));
    }
    return all;
  };
  for (const auto& [a, b] : pairs) {
    std::vector<const SparseVector*> both;
    for (const auto& y : columns_of(a)) both.push_back(&y);
    for (const auto& y : columns_of(b)) both.push_back(&y);
    const auto size = static_cast<Eigen::Index>(both.size());
    Eigen::MatrixXd joint(size, size);
    for (Eigen::Index i = 0; i < size; ++i) {
      for (Eigen::Index k = i; k < size; ++k) {
        joint(i, k) = joint(k, i) = dot(*both[std::size_t(i)], *both[std::size_t(k)]);
      }
    }
    joints.push_back(std::move(joint));
  }
  return joints;
}

}  // namespace lamina
