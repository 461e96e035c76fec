// Hungarian method on the connected groups of a sparse cost table.
#include <lamina/frontend/segments/assignment.hpp>

#include <algorithm>
#include <numeric>

namespace lamina {
namespace {
int root_of(std::vector<int>& parent, int i) {
  while (parent[static_cast<std::size_t>(i)] != i) {
    auto& p = parent[static_cast<std::size_t>(i)];
    p = parent[static_cast<std::size_t>(p)];
    i = p;
  }
  return i;
}

// Column of each row of a dense table, rows <= columns; potentials and shortest augmenting paths.
class Hungarian {
 public:
  Hungarian(const std::vector<double>& cost, int rows, int columns)
      : cost_(cost),
        rows_(rows),
        columns_(columns),
        u_(at(rows + 1), 0),
        v_(at(columns + 1), 0),
        match_(at(columns + 1), 0),
        way_(at(columns + 1), 0) {}
  std::vector<int> solve() {
    for (int row = 1; row <= rows_; ++row) augment(row);
    std::vector<int> result(at(rows_), -1);
    for (int j = 1; j <= columns_; ++j) {
      if (match_[at(j)] > 0) result[at(match_[at(j)] - 1)] = j - 1;
    }
    return result;
  }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  void augment(int row) {
    match_[0] = row;
    int column = 0;
    std::vector<double> least(at(columns_ + 1), std::numeric_limits<double>::infinity());
    std::vector<char> done(at(columns_ + 1), 0);
    do {
      done[at(column)] = 1;
      column = nearest_column(column, done, least);
    } while (match_[at(column)] != 0);
    for (; column != 0; column = way_[at(column)]) {
      match_[at(column)] = match_[at(way_[at(column)])];
    }
  }

  // The next one on the shortest path from `column` (Dijkstra), potentials brought up to it.
  int nearest_column(int column, const std::vector<char>& done, std::vector<double>& least) {
    const int i = match_[at(column)];
    double delta = std::numeric_limits<double>::infinity();
    int next = 0;
    for (int j = 1; j <= columns_; ++j) {
      if (done[at(j)]) continue;
      const double reduced = cost_[at((i - 1) * columns_ + j - 1)] - u_[at(i)] - v_[at(j)];
      if (reduced < least[at(j)]) {
        least[at(j)] = reduced;
        way_[at(j)] = column;
      }
      if (least[at(j)] < delta) {
        delta = least[at(j)];
        next = j;
      }
    }
    for (int j = 0; j <= columns_; ++j) {
      if (done[at(j)]) {
        u_[at(match_[at(j)])] += delta;
        v_[at(j)] -= delta;
      } else {
        least[at(j)] -= delta;
      }
    }
    return next;
  }

  const std::vector<double>& cost_;
  int rows_, columns_;
  std::vector<double> u_, v_;
  std::vector<int> match_, way_;
};

// One connected group: every row also has a private column that means "left alone".
void solve_group(const std::vector<AssignmentCandidate>& group, double unmatched_cost,
                 std::vector<int>& result) {
  if (group.size() == 1) {
    result[static_cast<std::size_t>(group[0].row)] = group[0].column;
    return;
  }
  std::vector<int> rows, columns;
  for (const AssignmentCandidate& c : group) {
    rows.push_back(c.row);
    columns.push_back(c.column);
  }
  for (std::vector<int>* ids : {&rows, &columns}) {
    std::sort(ids->begin(), ids->end());
    ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
  }
  const int n = static_cast<int>(rows.size()), m = static_cast<int>(columns.size());
  const int width = m + n;
  std::vector<double> cost(static_cast<std::size_t>(n * width), unmatched_cost);
  for (const AssignmentCandidate& c : group) {
    const auto i = std::lower_bound(rows.begin(), rows.end(), c.row) - rows.begin();
    const auto j = std::lower_bound(columns.begin(), columns.end(), c.column) - columns.begin();
    cost[static_cast<std::size_t>(i * width + j)] = c.cost;
  }
  const std::vector<int> chosen = Hungarian(cost, n, width).solve();
  for (int i = 0; i < n; ++i) {
    const int j = chosen[static_cast<std::size_t>(i)];
    if (j < 0 || j >= m || cost[static_cast<std::size_t>(i * width + j)] >= unmatched_cost)
      continue;
    result[static_cast<std::size_t>(rows[static_cast<std::size_t>(i)])] =
        columns[static_cast<std::size_t>(j)];
  }
}
}  // namespace

std::vector<int> assign(int rows, int columns, std::vector<AssignmentCandidate> candidates,
                        double unmatched_cost) {
  std::vector<int> result(static_cast<std::size_t>(rows), -1);
  std::erase_if(candidates, [&](const auto& c) { return !(c.cost < unmatched_cost); });
  std::vector<int> parent(static_cast<std::size_t>(rows + columns));
  std::iota(parent.begin(), parent.end(), 0);
  for (const AssignmentCandidate& c : candidates) {
    parent[static_cast<std::size_t>(root_of(parent, rows + c.column))] = root_of(parent, c.row);
  }
  std::stable_sort(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
    return root_of(parent, a.row) < root_of(parent, b.row);
  });
  for (std::size_t begin = 0; begin < candidates.size();) {
    std::size_t end = begin;
    const int root = root_of(parent, candidates[begin].row);
    while (end < candidates.size() && root_of(parent, candidates[end].row) == root) ++end;
    solve_group({candidates.begin() + static_cast<std::ptrdiff_t>(begin),
                 candidates.begin() + static_cast<std::ptrdiff_t>(end)},
                unmatched_cost, result);
    begin = end;
  }
  return result;
}

}  // namespace lamina
