// Strips of squares, counted and cut away.
#include <lamina/grid/evidence/plane_visibility.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <lamina/models/checked_cast.hpp>
#include <lamina/models/placed_outline.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

constexpr double kSquare = 0.1;    // m
constexpr double kFine = 0.05;     // m, of what is left of an outline; divides kSquare
constexpr double kWide = 0.02;     // m a pixel that still sees a square
constexpr double kFoot = 0.2;      // m above the ground
constexpr double kStride = 1;      // m: longer steps of a path do not tell its way
constexpr double kReach = 1;       // m of a wall's lower border over the floor it stands on
constexpr std::int32_t kBody = 3;  // squares from the path to where a robot's side may be

OutlineGrid grid_of(const MapPlane& plane, const SE3& T_map_squares, double square) {
  const SE3 T_squares_map = T_map_squares.inverse();
  OutlineGrid grid(square);
  for (const auto& outline : plane.outlines_map) {
    std::vector<Eigen::Vector2d> corners;
    for (const Eigen::Vector3d& p : outline) corners.push_back((T_squares_map * p).head<2>());
    if (const auto polygon = Polygon::from_vertices(std::move(corners))) grid.add(*polygon);
  }
  return grid;
}

}  // namespace

PlaneSquares::PlaneSquares(const MapPlane& plane, bool wall, PlaceColumns& columns) {
  Eigen::Matrix3d R;
  R.col(2) = plane.plane_map.normal();
  R.col(0) = Eigen::Vector3d::UnitZ().cross(R.col(2)).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  T_map_squares_ = SE3(SO3(Eigen::Quaterniond(R)), plane.centroid_map);
  std::map<std::int32_t, PlaceColumn> strips;
  for (const auto& [i, j] : grid_of(plane, T_map_squares_, kSquare).cells()) {  // ascending
    PlaceColumn& strip = strips.try_emplace(i, kWide).first->second;
    strip.wall = wall;
    low_ = std::min(low_, kSquare * j);
    high_ = std::max(high_, kSquare * (j + 1));
    strip.add(T_map_squares_ * (kSquare * Eigen::Vector3d(i + 0.5, j + 0.5, 0)));
  }
  for (auto& [i, strip] : strips) {
    Strip& added = strips_.emplace_back();
    added.i = i;
    const std::size_t size = strip.size(), at = columns.add(std::move(strip));
    for (std::size_t k = 0; k < size; ++k) added.seats.push_back({at, k});
  }
}

PlaneSquares::Count PlaneSquares::count(const Strip& strip, const PlaceColumns& columns,
                                        const GroundHits& ground, bool by_nearest) const {
  Count found;
  for (const Seat& seat : strip.seats) {
    const PlaceColumn& column = columns[seat.column];
    const Eigen::Vector3d& p = column.at_map(seat.place);
    const auto z = ground.under(p);
    if (z && p.z() - *z < kFoot) continue;
    if (column.no_wall(seat.place) || (by_nearest && column.outvoted(seat.place))) {
      ++found.no_wall;
    } else if (column.moved_along(seat.place)) {
      ++found.moved_along;
    } else {
      found.stands += column.met(seat.place);
    }
  }
  return found;
}

PlaneSquares::Count PlaneSquares::count(const PlaceColumns& columns,
                                        const GroundHits& ground) const {
  Count sum;
  for (const Strip& strip : strips_) {
    const Count found = count(strip, columns, ground, false);
    sum.no_wall += found.no_wall;
    sum.moved_along += found.moved_along;
    sum.stands += found.stands;
  }
  return sum;
}

std::set<std::int32_t> PlaneSquares::gone(const PlaceColumns& columns, const GroundHits& ground,
                                          bool by_nearest) const {
  std::set<std::int32_t> gone;
  for (const Strip& strip : strips_) {
    if (count(strip, columns, ground, by_nearest).gone()) gone.insert(strip.i);
  }
  return gone;
}

// Not where nothing would be left.
bool PlaneSquares::cut(MapPlane& plane, const std::set<std::int32_t>& gone) const {
  if (gone.empty()) return false;
  OutlineGrid left(kFine);
  for (const auto& cell : grid_of(plane, T_map_squares_, kFine).cells()) {
    const auto strip = to_cell((cell.first + 0.5) * kFine / kSquare);
    if (gone.count(strip) == 0) left.add_cell(cell);
  }
  const auto outlines = outlines_in(left, T_map_squares_);
  if (outlines.empty()) return false;
  plane.outlines_map = outlines;
  plane.ring_map = ring_in(left, T_map_squares_);
  plane.area = left.area();
  return true;
}

void PlaneSquares::cut(MapPlane& plane, const PlaceColumns& columns, const GroundHits& ground,
                       std::vector<EdgePoint>& ends) const {
  const std::set<std::int32_t> strips = gone(columns, ground, false);
  if (!cut(plane, strips)) return;
  for (const Strip& strip : strips_) {
    if (strips.count(strip.i) > 0) add_ends(strip, columns, ends);
  }
}

// Where steps of the path cross the plane, by strips, which may be none of its own.
std::set<std::int32_t> PlaneSquares::crossed_by(const Trajectory& path) const {
  const SE3 T_squares_map = T_map_squares_.inverse();
  std::set<std::int32_t> crossed;
  for (std::size_t k = 1; k < path.size(); ++k) {
    const Eigen::Vector3d a = T_squares_map * path[k - 1].pose.translation(),
                          b = T_squares_map * path[k].pose.translation();
    if ((a.z() < 0) == (b.z() < 0) || (b - a).norm() > kStride) continue;
    const Eigen::Vector3d at = a + a.z() / (a.z() - b.z()) * (b - a);
    if (low_ - kReach < at.y() && at.y() < high_) crossed.insert(to_cell(at.x() / kSquare));
  }
  return crossed;
}

void PlaneSquares::open_where_driven(MapPlane& plane, const PlaceColumns& columns,
                                     const GroundHits& ground, const Trajectory& path) const {
  const std::set<std::int32_t> crossed = crossed_by(path);
  if (crossed.empty()) return;
  const std::set<std::int32_t> away = gone(columns, ground, true);
  std::set<std::int32_t> all, doors;
  for (const Strip& strip : strips_) all.insert(strip.i);
  for (const std::int32_t middle : crossed) {
    for (const std::int32_t step : {-1, 1}) {
      for (std::int32_t i = middle; std::abs(i - middle) <= kBody || away.count(i) > 0; i += step) {
        if (all.count(i) == 0) continue;
        if (away.count(i) == 0) break;
        doors.insert(i);
      }
    }
  }
  cut(plane, doors);
}

void PlaneSquares::add_ends(const PlaceColumns& columns, std::vector<EdgePoint>& ends) const {
  for (const Strip& strip : strips_) add_ends(strip, columns, ends);
}

void PlaneSquares::add_ends(const Strip& strip, const PlaceColumns& columns,
                            std::vector<EdgePoint>& ends) const {
  for (const Seat& seat : strip.seats) {
    const PlaceColumn& column = columns[seat.column];
    if (column.moved_along(seat.place) && !column.no_wall(seat.place))
      ends.push_back({column.at_map(seat.place), 0, false});
  }
}

}  // namespace lamina
