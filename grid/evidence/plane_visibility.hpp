// Upright planes in squares, which looks are asked of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include <lamina/grid/evidence/ground_surfaces.hpp>
#include <lamina/grid/evidence/occupancy_column.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

/// A place among all.
struct Seat {
  std::size_t column = 0, place = 0;
};

/// Squares of 10 cm of a plane that stands upright, in strips that stand upright, too.
class PlaneSquares {
 public:
  PlaneSquares(const MapPlane& plane, bool wall, PlaceColumns& columns);

  struct Count {
    std::size_t no_wall = 0, moved_along = 0, stands = 0;
    /// More of it is no wall, or went along with what has gone, than stands.
    bool gone() const { return no_wall + moved_along > stands; }
  };
  /// Without those near the ground, which is met there instead.
  Count count(const PlaceColumns& columns, const GroundHits& ground) const;
  /// Takes the strips that are gone out of the plane's outlines. Where they only went along, `ends`
  /// gets their squares.
  void cut(MapPlane& plane, const PlaceColumns& columns, const GroundHits& ground,
           std::vector<EdgePoint>& ends) const;
  /// Takes doors out that the path goes through: strips that are gone, beside one another, where it
  /// crosses one of them. Views from afar, or of somebody who stood there, closed them.
  void open_where_driven(MapPlane& plane, const PlaceColumns& columns, const GroundHits& ground,
                         const Trajectory& path) const;
  /// Adds the squares that only went along.
  void add_ends(const PlaceColumns& columns, std::vector<EdgePoint>& ends) const;

 private:
  struct Strip {
    std::int32_t i = 0;
    std::vector<Seat> seats;
  };
  /// `by_nearest`: what looks from near outvote is no wall, too.
  Count count(const Strip& strip, const PlaceColumns& columns, const GroundHits& ground,
              bool by_nearest) const;
  std::set<std::int32_t> gone(const PlaceColumns& columns, const GroundHits& ground,
                              bool by_nearest) const;
  std::set<std::int32_t> crossed_by(const Trajectory& path) const;
  bool cut(MapPlane& plane, const std::set<std::int32_t>& gone) const;
  void add_ends(const Strip& strip, const PlaceColumns& columns,
                std::vector<EdgePoint>& ends) const;
  SE3 T_map_squares_;
  double low_ = 0, high_ = 0;  // m, of all squares, upward from the plane's centre
  std::vector<Strip> strips_;
};

}  // namespace lamina
