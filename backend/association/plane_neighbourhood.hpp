// Planes with evidence, and which are near which.
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/association/plane_index.hpp>
#include <lamina/backend/graph/graph.hpp>

namespace lamina {

/// What the graph believes of a plane: where its evidence is and how much.
struct PinnedViews {
  Moments anchor;  ///< map axes about the plane's anchor
  int views = 0;
};

/// The active planes that the refiner believes views of, by place. Keeps a reference to the graph.
class PlaneNeighbourhood {
 public:
  /// Areas reach `gap_m` to two by cubes. `lines`: only planes that scans alone have seen, half of
  /// that.
  PlaneNeighbourhood(const Graph& graph,
                     const std::map<PlaneId, std::vector<OutlinePiece>>& outlines, double gap_m,
                     bool lines);
  /// (fewer views, more views), each pair once, turned by less than that, an area in one of them.
  std::vector<std::pair<PlaneId, PlaneId>> pairs(double max_angle) const;
  /// What lies between the two is no wider than what is seen of either that way (piece_gap.hpp),
  /// nor than the gap.
  bool beside(PlaneId a, PlaneId b) const;
  const PinnedViews& seen(PlaneId id) const { return seen_.at(id); }
  std::vector<PlaneId> smallest_first() const;
  /// Other planes near it that are still there.
  std::vector<PlaneId> around(PlaneId a) const;
  void join(PlaneId from, PlaneId into);
  /// It and what has joined it.
  std::vector<PlaneId> members(PlaneId id) const;
  Eigen::Vector3d middle(PlaneId id) const {
    return seen_.at(id).anchor.mean() + graph_.at(id).anchor_map;
  }

 private:
  const Graph& graph_;
  double gap_;
  std::map<PlaneId, PinnedViews> seen_;
  std::set<PlaneId> gone_, lines_;
  std::map<PlaneId, std::vector<PlaneId>> members_;
  std::map<PlaneId, std::vector<Eigen::Vector3d>> samples_;
  PlaneIndex index_;
};

}  // namespace lamina
