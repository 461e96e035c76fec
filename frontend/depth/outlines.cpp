// Boundary tracing on the block lattice.
#include <lamina/frontend/depth/outlines.hpp>

#include <array>
#include <cmath>

#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

// Directions of a boundary edge in image axes: right, down, left, up.
constexpr std::array<int, 4> kDu{1, 0, -1, 0};
constexpr std::array<int, 4> kDv{0, 1, 0, -1};

struct Edge {
  int u, v, direction;
};

class Tracer {
 public:
  Tracer(int columns, int rows)
      : stride_(columns + 1),
        out_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(rows + 1), 0) {}

  // Loops of one label's edges; the one that encloses most, by absolute area.
  std::vector<Eigen::Vector2d> longest(std::span<const Edge> edges) {
    for (const Edge& e : edges) bits(e.u, e.v) |= static_cast<std::uint8_t>(1 << e.direction);
    std::vector<Eigen::Vector2d> best;
    double best_area = 0;
    for (const Edge& e : edges) {
      if (!(bits(e.u, e.v) & (1 << e.direction))) continue;
      double area = 0;
      std::vector<Eigen::Vector2d> loop = follow(e, area);
      if (std::abs(area) > best_area) {
        best_area = std::abs(area);
        best = std::move(loop);
      }
    }
    return best;
  }

 private:
  std::uint8_t& bits(int u, int v) {
    return out_[static_cast<std::size_t>(v) * static_cast<std::size_t>(stride_) +
                static_cast<std::size_t>(u)];
  }

  std::vector<Eigen::Vector2d> follow(const Edge& start, double& area) {
    std::vector<Eigen::Vector2d> loop;
    int u = start.u, v = start.v, direction = start.direction, last = -1;
    while (bits(u, v) & (1 << direction)) {
      bits(u, v) = static_cast<std::uint8_t>(bits(u, v) & ~(1 << direction));
      if (direction != last) loop.emplace_back(u, v);
      last = direction;
      const int nu = u + kDu[static_cast<std::size_t>(direction)];
      const int nv = v + kDv[static_cast<std::size_t>(direction)];
      area += 0.5 * (u * nv - nu * v);
      u = nu;
      v = nv;
      // The inside is on the right of an edge: turning right first keeps diagonal blocks apart.
      for (const int turn : {1, 0, 3}) {
        const int next = (direction + turn) % 4;
        if (bits(u, v) & (1 << next)) {
          direction = next;
          break;
        }
      }
    }
    return loop;
  }

  int stride_;
  std::vector<std::uint8_t> out_;
};

}  // namespace

std::vector<std::vector<Eigen::Vector2d>> trace_outlines(std::span<const std::int16_t> labels,
                                                         int columns, int rows, int label_count,
                                                         double tolerance) {
  std::vector<std::vector<Edge>> edges(static_cast<std::size_t>(label_count));
  const auto label = [&](int c, int r) -> int {
    if (c < 0 || r < 0 || c >= columns || r >= rows) return -1;
    return labels[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                  static_cast<std::size_t>(c)];
  };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int k = label(c, r);
      if (k < 0 || k >= label_count) continue;
      auto& mine = edges[static_cast<std::size_t>(k)];
      if (label(c, r - 1) != k) mine.push_back({c, r, 0});
      if (label(c + 1, r) != k) mine.push_back({c + 1, r, 1});
      if (label(c, r + 1) != k) mine.push_back({c + 1, r + 1, 2});
      if (label(c - 1, r) != k) mine.push_back({c, r + 1, 3});
    }
  }
  std::vector<std::vector<Eigen::Vector2d>> result(static_cast<std::size_t>(label_count));
  Tracer tracer(columns, rows);
  for (std::size_t k = 0; k < result.size(); ++k) {
    if (edges[k].empty()) continue;
    const auto polygon = Polygon::from_vertices(tracer.longest(edges[k]));
    if (polygon) result[k] = polygon->simplified(tolerance).vertices();
  }
  return result;
}

}  // namespace lamina
