// The traversability graph for one robot, as Boost.Graph takes it: internal to the planner.
#pragma once

#include <boost/graph/graph_traits.hpp>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include <lamina/grid/clearance.hpp>
#include <lamina/grid/planner.hpp>
#include <lamina/grid/traversability.hpp>

namespace lamina {

inline constexpr int kDirections[8][2] = {{-1, -1}, {0, -1}, {1, -1}, {-1, 0},
                                          {1, 0},   {-1, 1}, {0, 1},  {1, 1}};

class OutEdges;

/// Where a robot of some radius fits. Vertices are numbers of cells in the known rectangle, lower
/// left first.
class RobotGraph {
 public:
  using Vertex = std::int32_t;
  struct Edge {
    Vertex from = 0, to = 0;
    bool operator==(const Edge&) const = default;
  };
  // What boost::graph_traits reads.
  using vertex_descriptor = Vertex;
  using edge_descriptor = Edge;
  using directed_category = boost::directed_tag;
  using edge_parallel_category = boost::disallow_parallel_edge_tag;
  using traversal_category = boost::incidence_graph_tag;
  using out_edge_iterator = OutEdges;
  using degree_size_type = std::size_t;
  static Vertex null_vertex() { return -1; }

  RobotGraph(const NavigabilityGrid& grid, const GridGeometry& geometry,
             const PlannerOptions& options)
      : g_(geometry),
        options_(options),
        graph_(grid, options.max_step),
        clearance_(clearance_image(grid, geometry)) {}

  std::size_t size() const {
    return static_cast<std::size_t>(g_.width) * static_cast<std::size_t>(g_.height);
  }
  Vertex vertex(const CellIndex& c) const {
    return (c.j - g_.first.j) * g_.width + c.i - g_.first.i;
  }
  CellIndex cell(Vertex v) const { return {g_.first.i + v % g_.width, g_.first.j + v / g_.width}; }
  Eigen::Vector2d position(Vertex v) const { return center_of(cell(v), g_.resolution); }
  /// From the robot's centre to the border of the nearest cell it must not touch.
  double clearance(const CellIndex& c) const {
    return static_cast<double>(clearance_[g_.image_index(c)]) - g_.resolution / 2;
  }
  bool fits(const CellIndex& c) const {
    return g_.contains(c) && graph_.navigable(c) && clearance(c) >= options_.robot_radius;
  }
  bool edge(Vertex from, int direction, Edge& out) const {
    const CellIndex a = cell(from);
    const CellIndex b{a.i + kDirections[direction][0], a.j + kDirections[direction][1]};
    if (!fits(b) || !graph_.edge(a, b)) return false;
    out = {from, vertex(b)};
    return true;
  }
  double cost(const Edge& e) const {
    const CellIndex b = cell(e.to);
    const double room = (clearance(b) - options_.robot_radius) / std::max(options_.comfort, 1e-9);
    const double value = static_cast<double>(graph_.grid().find(b)->navigability);
    return (position(e.to) - position(e.from)).norm() *
           (1 + options_.clear_weight * std::max(0.0, 1 - room) +
            options_.level_weight * (1 / value - 1));
  }

 private:
  GridGeometry g_;
  const PlannerOptions& options_;
  TraversabilityGraph graph_;
  std::vector<float> clearance_;
};

/// The edges out of a vertex, found as they are asked for.
class OutEdges {
 public:
  using iterator_category = std::forward_iterator_tag;
  using value_type = RobotGraph::Edge;
  using difference_type = std::ptrdiff_t;
  using pointer = const value_type*;
  using reference = value_type;

  OutEdges() = default;
  /// The first edge; without a graph the end.
  OutEdges(const RobotGraph& graph, RobotGraph::Vertex from)
      : graph_(&graph), from_(from), direction_(-1) {
    ++*this;
  }
  RobotGraph::Edge operator*() const { return edge_; }
  OutEdges& operator++() {
    while (++direction_ < 8 && !graph_->edge(from_, direction_, edge_)) {
    }
    return *this;
  }
  OutEdges operator++(int) {
    OutEdges before = *this;
    ++*this;
    return before;
  }
  bool operator==(const OutEdges& other) const { return direction_ == other.direction_; }

 private:
  const RobotGraph* graph_ = nullptr;
  RobotGraph::Vertex from_ = 0;
  int direction_ = 8;
  RobotGraph::Edge edge_;
};

inline std::pair<OutEdges, OutEdges> out_edges(RobotGraph::Vertex v, const RobotGraph& graph) {
  return {OutEdges(graph, v), OutEdges()};
}
inline RobotGraph::Vertex source(const RobotGraph::Edge& e, const RobotGraph&) { return e.from; }
inline RobotGraph::Vertex target(const RobotGraph::Edge& e, const RobotGraph&) { return e.to; }
inline std::size_t out_degree(RobotGraph::Vertex v, const RobotGraph& graph) {
  return static_cast<std::size_t>(std::distance(OutEdges(graph, v), OutEdges()));
}

}  // namespace lamina
