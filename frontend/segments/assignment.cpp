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
std::vector<int> hungarian(const std::vector<double>& cost, int rows, int columns) {
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  std::vector<double> u(at(rows + 1), 0), v(at(columns + 1), 0);
  std::vector<int> match(at(columns + 1), 0), way(at(columns + 1), 0);
  for (int row = 1; row <= rows; ++row) {
    match[0] = row;
    int column = 0;
    std::vector<double> least(at(columns + 1), std::numeric_limits<double>::infinity());
    std::vector<char> done(at(columns + 1), 0);
    do {
      done[at(column)] = 1;
      const int i = match[at(column)];
      double delta = std::numeric_limits<double>::infinity();
      int next = 0;
      for (int j = 1; j <= columns; ++j) {
        if (done[at(j)]) continue;
        const double reduced = cost[at((i - 1) * columns + j - 1)] - u[at(i)] - v[at(j)];
        if (reduced < least[at(j)]) {
          least[at(j)] = reduced;
          way[at(j)] = column;
        }
        if (least[at(j)] < delta) {
          delta = least[at(j)];
          next = j;
        }
      }
      for (int j = 0; j <= columns; ++j) {
        if (done[at(j)]) {
          u[at(match[at(j)])] += delta;
          v[at(j)] -= delta;
        } else {
          least[at(j)] -= delta;
        }
      }
      column = next;
    } while (match[at(column)] != 0);
    for (; column != 0; column = way[at(column)]) {
      match[at(column)] = match[at(way[at(column)])];
    }
  }
  std::vector<int> result(at(rows), -1);
  for (int j = 1; j <= columns; ++j) {
    if (match[at(j)] > 0) result[at(match[at(j)] - 1)] = j - 1;
  }
  return result;
}

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
  const std::vector<int> chosen = hungarian(cost, n, width);
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
