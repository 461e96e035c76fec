// Block ordering, assembly in place, CHOLMOD.
#include <cholmod.h>
#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <lamina/backend/solver/native/block_cholesky_impl.hpp>
#include <lamina/models/error.hpp>

namespace lamina {

using detail::Pattern;

namespace {

Pattern lower_pattern(int variables, std::vector<std::pair<int, int>>& column_row) {
  std::sort(column_row.begin(), column_row.end());
  column_row.erase(std::unique(column_row.begin(), column_row.end()), column_row.end());
  Pattern pattern;
  pattern.starts.assign(static_cast<std::size_t>(variables) + 1, 0);
  pattern.rows.reserve(column_row.size());
  for (const auto& [column, row] : column_row) {
    ++pattern.starts[static_cast<std::size_t>(column) + 1];
    pattern.rows.push_back(row);
  }
  std::partial_sum(pattern.starts.begin(), pattern.starts.end(), pattern.starts.begin());
  return pattern;
}

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// While it lives, this thread's OpenMP regions run on one thread. CHOLMOD asks for four in every
/// supernode; on blocks as small as a map's they do nothing but spin for each other: twice the
/// processor time on a quiet machine, and a hundred times the wall time on a busy one. Where OpenMP
/// is absent there is nothing to do.
class OneThread {
 public:
  OneThread() : set_(reinterpret_cast<Set*>(dlsym(RTLD_DEFAULT, "omp_set_max_active_levels"))) {
    auto* get = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "omp_get_max_active_levels"));
    if (get == nullptr || set_ == nullptr) return;
    before_ = get();
    set_(0);
  }
  ~OneThread() {
    if (before_ >= 0) set_(before_);
  }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  using Set = void(int);
  Set* set_;
  int before_ = -1;
};

}  // namespace

void BlockSlot::add_block(const Eigen::MatrixXd& block) const {
  const Eigen::Index rows = transposed ? block.cols() : block.rows();
  const Eigen::Index cols = transposed ? block.rows() : block.cols();
  using Stride = Eigen::OuterStride<>;
  Eigen::Map<Eigen::MatrixXd, 0, Stride> target(base, rows, cols, Stride(stride));
  if (transposed) {
    target += block.transpose();
  } else {
    target += block;
  }
}

cholmod_sparse detail::lower_view(int n, std::vector<int>& starts, std::vector<int>& rows,
                                  double* values) {
  cholmod_sparse A{};
  A.nrow = A.ncol = static_cast<std::size_t>(n);
  A.nzmax = rows.size();
  A.p = starts.data();
  A.i = rows.data();
  A.x = values;
  A.stype = -1;
  A.itype = CHOLMOD_INT;
  A.xtype = values != nullptr ? CHOLMOD_REAL : CHOLMOD_PATTERN;
  A.dtype = CHOLMOD_DOUBLE;
  A.sorted = 1;
  A.packed = 1;
  return A;
}

void BlockCholesky::Impl::order_blocks(const std::vector<std::pair<int, int>>& pairs) {
  const int variables = static_cast<int>(sizes.size());
  std::vector<std::pair<int, int>> lower;
  lower.reserve(pairs.size() + sizes.size());
  for (int v = 0; v < variables; ++v) lower.emplace_back(v, v);
  for (const auto& [a, b] : pairs) {
    LAMINA_CHECK(a != b && std::min(a, b) >= 0 && std::max(a, b) < variables);
    lower.emplace_back(std::min(a, b), std::max(a, b));
  }
  Pattern pattern = lower_pattern(variables, lower);
  order.resize(sizes.size());
  std::iota(order.begin(), order.end(), 0);
  if (variables > 1) {
    cholmod_sparse A = detail::lower_view(variables, pattern.starts, pattern.rows, nullptr);
    if (!cholmod_amd(&A, nullptr, 0, order.data(), &common.c)) {
      std::iota(order.begin(), order.end(), 0);
    }
  }
  position.resize(sizes.size());
  for (int p = 0; p < variables; ++p) position[at(order[at(p)])] = p;
  for (auto& [column, row] : lower) {
    const int p = position[at(column)], q = position[at(row)];
    column = std::min(p, q);
    row = std::max(p, q);
  }
  blocks = lower_pattern(variables, lower);
}

void BlockCholesky::Impl::number_rows() {
  const int variables = static_cast<int>(sizes.size());
  first_row.resize(sizes.size());
  ordered_row.resize(sizes.size());
  int row = 0;
  for (int v = 0; v < variables; ++v) {
    first_row[at(v)] = row;
    row += sizes[at(v)];
  }
  n = row;
  row = 0;
  for (const int v : order) {
    ordered_row[at(v)] = row;
    row += sizes[at(v)];
  }
}

void BlockCholesky::Impl::lay_out() {
  number_rows();
  const int variables = static_cast<int>(sizes.size());
  block_offset.resize(blocks.rows.size());
  starts.assign(1, 0);
  starts.reserve(at(n) + 1);
  diagonal_place.resize(at(n));
  std::size_t entries = 0;
  for (int p = 0; p < variables; ++p) {
    int height = 0;
    for (int k = blocks.starts[at(p)]; k < blocks.starts[at(p) + 1]; ++k) {
      block_offset[at(k)] = height;
      height += sizes[at(order[at(blocks.rows[at(k)])])];
    }
    entries += at(height * sizes[at(order[at(p)])]);
  }
  rows.resize(entries);
  int filled = 0;
  for (int p = 0; p < variables; ++p) {
    const int v = order[at(p)];
    for (int c = 0; c < sizes[at(v)]; ++c) {
      diagonal_place[at(first_row[at(v)] + c)] = at(filled + c);
      for (int k = blocks.starts[at(p)]; k < blocks.starts[at(p) + 1]; ++k) {
        const int u = order[at(blocks.rows[at(k)])];
        for (int r = 0; r < sizes[at(u)]; ++r) rows[at(filled++)] = ordered_row[at(u)] + r;
      }
      starts.push_back(filled);
    }
  }
  values.assign(rows.size(), 0.0);
  damped = values;
}

void BlockCholesky::Impl::analyze() {
  if (n == 0) return;
  common.c.nmethods = 1;
  common.c.method[0].ordering = CHOLMOD_NATURAL;
  common.c.postorder = 0;
  // Without supernodes CHOLMOD transposes the matrix anew in every factorize(): in a large one that
  // is 100 MB of fresh pages each time, and dearer than the products that supernodes waste.
  constexpr int kLarge = 50000;
  common.c.supernodal = n > kLarge ? CHOLMOD_SUPERNODAL : CHOLMOD_AUTO;
  cholmod_sparse A = matrix(damped);
  L = cholmod_analyze(&A, &common.c);
  LAMINA_CHECK(L != nullptr);
}

template <class F>
void BlockCholesky::Impl::each_pivot(F&& f) const {
  if (n == 0 || L->xtype == CHOLMOD_PATTERN) return;
  const auto* x = static_cast<const double*>(L->x);
  if (!L->is_super) {
    const auto* p = static_cast<const int*>(L->p);
    for (int j = 0; j < n; ++j) f(j, L->is_ll ? x[p[j]] * x[p[j]] : x[p[j]]);
    return;
  }
  const auto* super = static_cast<const int*>(L->super);
  const auto* pi = static_cast<const int*>(L->pi);
  const auto* px = static_cast<const int*>(L->px);
  for (std::size_t s = 0; s < L->nsuper; ++s) {
    const int height = pi[s + 1] - pi[s];
    for (int j = super[s], c = 0; j < super[s + 1]; ++j, ++c) {
      const double diagonal = x[px[s] + c * height + c];
      f(j, diagonal * diagonal);
    }
  }
}

BlockCholesky::BlockCholesky(std::vector<int> sizes, std::vector<std::pair<int, int>> pairs)
    : impl_(std::make_unique<Impl>()) {
  impl_->sizes = std::move(sizes);
  impl_->order_blocks(pairs);
  pairs.clear();
  pairs.shrink_to_fit();
  impl_->lay_out();
  impl_->analyze();
}

BlockCholesky::~BlockCholesky() = default;
BlockCholesky::BlockCholesky(BlockCholesky&&) noexcept = default;
BlockCholesky& BlockCholesky::operator=(BlockCholesky&&) noexcept = default;

int BlockCholesky::dimension() const { return impl_->n; }
int BlockCholesky::row_of(int variable) const { return impl_->first_row[at(variable)]; }

BlockSlot BlockCholesky::slot(int a, int b) {
  const int p = impl_->position[at(a)], q = impl_->position[at(b)];
  const int column = std::min(p, q), row = std::max(p, q);
  const auto begin = impl_->blocks.rows.begin() + impl_->blocks.starts[at(column)];
  const auto end = impl_->blocks.rows.begin() + impl_->blocks.starts[at(column) + 1];
  const auto found = std::lower_bound(begin, end, row);
  LAMINA_CHECK(found != end && *found == row);
  const auto k = at(static_cast<int>(found - impl_->blocks.rows.begin()));
  const int first_column = impl_->ordered_row[at(impl_->order[at(column)])];
  const int start = impl_->starts[at(first_column)];
  BlockSlot slot;
  slot.base = impl_->values.data() + start + impl_->block_offset[k];
  slot.stride = impl_->starts[at(first_column) + 1] - start;
  slot.transposed = p < q;
  return slot;
}

void BlockCholesky::set_zero() { std::fill(impl_->values.begin(), impl_->values.end(), 0.0); }

Eigen::VectorXd BlockCholesky::diagonal() const {
  Eigen::VectorXd d(impl_->n);
  for (int i = 0; i < impl_->n; ++i) d(i) = impl_->values[impl_->diagonal_place[at(i)]];
  return d;
}

bool BlockCholesky::factorize(const Eigen::VectorXd& added) {
  Impl& s = *impl_;
  if (s.n == 0) return true;
  s.damped = s.values;
  s.factored_diagonal.resize(s.n);
  for (std::size_t v = 0; v < s.sizes.size(); ++v) {
    for (int c = 0; c < s.sizes[v]; ++c) {
      double& d = s.damped[s.diagonal_place[at(s.first_row[v] + c)]];
      d += added(s.first_row[v] + c);
      s.factored_diagonal(s.ordered_row[v] + c) = d;
    }
  }
  const OneThread one_thread;
  cholmod_sparse A = s.matrix(s.damped);
  const bool done = cholmod_factorize(&A, s.L, &s.common.c) != 0;
  return done && s.common.c.status == CHOLMOD_OK && s.L->minor == at(s.n);
}

Eigen::VectorXd BlockCholesky::solve(const Eigen::VectorXd& b) {
  Impl& s = *impl_;
  Eigen::VectorXd ordered(s.n), x(s.n);
  for (std::size_t v = 0; v < s.sizes.size(); ++v) {
    ordered.segment(s.ordered_row[v], s.sizes[v]) = b.segment(s.first_row[v], s.sizes[v]);
  }
  cholmod_dense rhs{};
  rhs.nrow = rhs.nzmax = rhs.d = at(s.n);
  rhs.ncol = 1;
  rhs.x = ordered.data();
  rhs.xtype = CHOLMOD_REAL;
  rhs.dtype = CHOLMOD_DOUBLE;
  const OneThread one_thread;
  cholmod_dense* solution = cholmod_solve(CHOLMOD_A, s.L, &rhs, &s.common.c);
  if (solution == nullptr) return Eigen::VectorXd::Zero(s.n);
  const Eigen::Map<const Eigen::VectorXd> y(static_cast<const double*>(solution->x), s.n);
  for (std::size_t v = 0; v < s.sizes.size(); ++v) {
    x.segment(s.first_row[v], s.sizes[v]) = y.segment(s.ordered_row[v], s.sizes[v]);
  }
  cholmod_free_dense(&solution, &s.common.c);
  return x;
}

int BlockCholesky::weak_pivots(double threshold) const {
  const Impl& s = *impl_;
  if (s.n == 0) return 0;
  if (s.factored_diagonal.size() == 0) return s.n;  // nothing was ever factored
  // An entry this small never had a factor: what stands there is damping alone.
  const double nothing = 1e-18 * s.factored_diagonal.maxCoeff();
  int weak = 0;
  s.each_pivot([&](int row, double pivot) {
    const double before = s.factored_diagonal(row);  // elimination, damping included
    if (!(pivot > threshold * before) || !(before > nothing)) ++weak;
  });
  return weak;
}

double BlockCholesky::factor_entries() const { return impl_->common.c.lnz; }
double BlockCholesky::factor_flops() const { return impl_->common.c.fl; }

}  // namespace lamina
