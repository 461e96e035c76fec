// Places of the map, and what every look says of those in its reach.
#include <lamina/apps/sight_votes.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <lamina/apps/ground_hits.hpp>
#include <lamina/apps/place_votes.hpp>
#include <lamina/apps/scan_sight.hpp>
#include <lamina/frontend/obstacles/depth_looker.hpp>
#include <lamina/io/session_archive.hpp>
#include <lamina/models/model_archive.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina::apps {
namespace {

constexpr double kInterval = kLookInterval;  // between scans, too
constexpr double kWide = 0.02;               // m a pixel that still sees squares of planes
constexpr double kRadius = 0.06;    // m about a place: half a cell's diagonal, and poses' errors
constexpr double kSquare = 0.1;     // m, of planes
constexpr double kLevel = 0.15;     // m of height that loose points share
constexpr int kBelow = 4;           // levels
constexpr double kFoot = 0.2;       // m above the ground
constexpr double kFarthest = 8;     // m
constexpr double kUpright = 0.5;    // |n.z| below
constexpr double kPerson = 1;       // m^2 of a plane: no person is larger
constexpr std::size_t kFewest = 2;  // squares
constexpr std::size_t kTrust = 10;  // one in so many squares of large planes may be no wall

std::string bytes_of(const io::SeenDepth& seen) {
  ArchiveWriter archive;
  archive(seen);
  return archive.bytes();
}

double reach_of(const DepthLook& look) {
  const auto most = std::max_element(look.reach.begin(), look.reach.end());
  return most == look.reach.end() ? 0 : std::min(kFarthest, DepthLook::depth(*most));
}

// Where a place stands among all.
struct Seat {
  std::size_t column = 0, place = 0;
};

// Middles of the squares of a plane's outlines.
std::vector<Seat> seat_squares(const MapPlane& plane, PlaceColumns& columns) {
  const Eigen::Vector3d& n = plane.plane_map.normal();
  const Eigen::Vector3d along = Eigen::Vector3d::UnitZ().cross(n).normalized();
  const Eigen::Vector3d up = n.cross(along);
  OutlineGrid grid(kSquare);
  for (const auto& outline : plane.outlines_map) {
    std::vector<Eigen::Vector2d> corners;
    for (const Eigen::Vector3d& p : outline) {
      const Eigen::Vector3d q = p - plane.centroid_map;
      corners.emplace_back(along.dot(q), up.dot(q));
    }
    if (const auto polygon = Polygon::from_vertices(std::move(corners))) grid.add(*polygon);
  }
  std::map<std::int32_t, PlaceColumn> strips;
  for (const auto& [i, j] : grid.cells()) {  // ascending
    PlaceColumn& strip = strips.try_emplace(i, kWide).first->second;
    strip.add(plane.centroid_map + kSquare * ((i + 0.5) * along + (j + 0.5) * up));
  }
  std::vector<Seat> seats;
  for (auto& [i, strip] : strips) {
    const std::size_t size = strip.size(), at = columns.add(std::move(strip));
    for (std::size_t k = 0; k < size; ++k) seats.push_back({at, k});
  }
  return seats;
}

struct Squares {
  std::size_t no_wall = 0, stands = 0;
};

// Without those near the ground, which is met there instead.
Squares squares_of(const std::vector<Seat>& seats, const PlaceColumns& columns,
                   const GroundHits& ground) {
  Squares found;
  for (const Seat& seat : seats) {
    const PlaceColumn& column = columns[seat.column];
    const Eigen::Vector3d& p = column.at_map(seat.place);
    const auto z = ground.under(p);
    if (z && p.z() - *z < kFoot) continue;
    const bool no_wall = column.no_wall(seat.place);
    found.no_wall += no_wall;
    found.stands += !no_wall && column.met(seat.place);
  }
  return found;
}

// Loose points of one cell and level are one place, at the height of the lowest of them.
class LoosePoints {
 public:
  LoosePoints(const std::vector<Eigen::Vector3d>& points, double resolution, PlaceColumns& columns)
      : resolution_(resolution) {
    std::map<std::pair<std::int64_t, std::int64_t>, std::map<std::int64_t, double>> cells;
    for (const Eigen::Vector3d& p : points) {
      if (!p.allFinite() || p.norm() > 1e7) continue;
      const auto [i, j, level] = key(p);
      const auto at = cells[{i, j}].try_emplace(level, p.z()).first;
      at->second = std::min(at->second, p.z());
    }
    for (auto& [cell, levels] : cells) {
      // What stands below, too: places of their own for it.
      for (std::int64_t k = levels.rbegin()->first; k >= levels.rbegin()->first - kBelow; --k) {
        levels.try_emplace(k, (static_cast<double>(k) + 0.5) * kLevel);
      }
      PlaceColumn column;
      for (const auto& [level, z] : levels) {
        seats_[{cell.first, cell.second, level}] = {0, column.size()};
        column.add({resolution * (static_cast<double>(cell.first) + 0.5),
                    resolution * (static_cast<double>(cell.second) + 0.5), z});
      }
      const std::size_t at = columns.add(std::move(column));
      for (const auto& [level, z] : levels) seats_[{cell.first, cell.second, level}].column = at;
    }
  }
  const Seat* seat(const Eigen::Vector3d& p) const {
    if (!p.allFinite() || p.norm() > 1e7) return nullptr;
    const auto at = seats_.find(key(p));
    return at == seats_.end() ? nullptr : &at->second;
  }

 private:
  using Key = std::array<std::int64_t, 3>;
  Key key(const Eigen::Vector3d& p) const {
    const auto index = [](double x, double size) {
      return static_cast<std::int64_t>(std::floor(x / size));
    };
    return {index(p.x(), resolution_), index(p.y(), resolution_), index(p.z(), kLevel)};
  }
  double resolution_;
  std::map<Key, Seat> seats_;
};

// Asks every look, and every scan that is no look made flat, of the places in its reach.
class Lookers {
 public:
  Lookers(const io::Spool& looks, const SightVotes::ForEachScan& scans, const Trajectory& path)
      : looks_(looks), scans_(scans), path_(path) {}

  /// take(stamp, sights, pixel, column).
  template <class Take>
  void ask(PlaceColumns& columns, const Take& take) const {
    looks_.for_each([&](std::string_view bytes) {
      io::SeenDepth seen;
      ArchiveReader archive(bytes);
      archive(seen);
      const DepthLook& look = seen.look;
      const double square = 1 / static_cast<double>(std::min(look.fx, look.fy));
      ask_one(columns, seen.stamp, seen.T_body_camera, reach_of(look), look.pixel, take,
              [&look, square](const Eigen::Vector3d& p) {
                return PlaceSight{look.at(p, kRadius), p.z(), kRadius + square * p.z()};
              });
    });
    std::optional<Timestamp> last;
    if (!scans_) return;
    scans_([&](const io::KeptScan& kept) {
      const LaserScan& scan = kept.scan;
      if (kept.from_depth || (last && std::abs(scan.stamp - *last) < kInterval)) return;
      last = scan.stamp;
      ask_one(columns, scan.stamp, scan.lidar.T_body_lidar, kFarthest, scan.angle_increment, take,
              [&scan](const Eigen::Vector3d& p) {
                return PlaceSight{sight_of(scan, p, kRadius), p.head<2>().norm(), kRadius};
              });
    });
  }

 private:
  template <class Take, class SightOf>
  void ask_one(PlaceColumns& columns, Timestamp stamp, const SE3& T_body_sensor, double reach,
               double pixel, const Take& take, const SightOf& sight_of_place) const {
    const auto T_map_body = path_.at(stamp);
    if (!T_map_body) return;
    const SE3 T_map_sensor = *T_map_body * T_body_sensor, T_sensor_map = T_map_sensor.inverse();
    std::vector<PlaceSight> sights;
    columns.for_each_near(T_map_sensor.translation(), reach, [&](PlaceColumn& column) {
      sights.clear();
      for (std::size_t k = 0; k < column.size(); ++k) {
        sights.push_back(sight_of_place(T_sensor_map * column.at_map(k)));
      }
      take(stamp, sights, pixel, column);
    });
  }

  const io::Spool& looks_;
  const SightVotes::ForEachScan& scans_;
  const Trajectory& path_;
};

}  // namespace

void SightVotes::take(const std::vector<io::SeenDepth>& seen) {
  looks_.clear();
  for (const io::SeenDepth& look : seen) looks_.add(bytes_of(look));
}

void SightVotes::add(Timestamp stamp, const DepthLook& look, const SE3& T_body_camera) {
  if (look.empty() || (last_ && stamp - *last_ < kInterval)) return;
  last_ = stamp;
  looks_.add(bytes_of({stamp, T_body_camera, look}));
}

void SightVotes::withdraw(PlanarMap& map, const Trajectory& trajectory, double resolution,
                          const ForEachScan& for_each_scan) const {
  if (looks_.size() == 0) return;
  PlaceColumns columns;
  const LoosePoints loose(map.loose_points, resolution, columns);
  std::map<std::int64_t, std::vector<Seat>> squares;  // by the plane's id
  for (const MapPlane& plane : map.planes) {
    if (std::abs(plane.plane_map.normal().z()) < kUpright)
      squares[plane.id] = seat_squares(plane, columns);
  }
  if (columns.empty()) return;
  const Lookers lookers(looks_, for_each_scan, trajectory);
  lookers.ask(columns, [](Timestamp stamp, const std::vector<PlaceSight>& sights, double,
                          PlaceColumn& column) { column.meet(stamp, sights); });
  lookers.ask(columns, [](Timestamp stamp, const std::vector<PlaceSight>& sights, double pixel,
                          PlaceColumn& column) { column.pass(stamp, sights, pixel); });
  const GroundHits ground(map.planes, GroundHits::Of::kAnyMap);
  std::vector<std::int64_t> gone;
  Squares large;
  for (const MapPlane& plane : map.planes) {
    const auto seats = squares.find(plane.id);
    if (seats == squares.end()) continue;
    const Squares found = squares_of(seats->second, columns, ground);
    if (plane.area > kPerson) {
      large.no_wall += found.no_wall;
      large.stands += found.stands;
    } else if (found.no_wall >= kFewest && found.no_wall > found.stands) {
      gone.push_back(plane.id);
    }
  }
  // No person, but walls that poses drew twice: this path cannot tell what went away.
  if (kTrust * large.no_wall > large.no_wall + large.stands) return;
  std::erase_if(map.planes, [&](const MapPlane& plane) {
    return std::find(gone.begin(), gone.end(), plane.id) != gone.end();
  });
  std::erase_if(map.loose_points, [&](const Eigen::Vector3d& p) {
    const Seat* seat = loose.seat(p);
    if (seat == nullptr) return false;
    const PlaceColumn& column = columns[seat->column];
    if (column.free_again(seat->place)) return true;
    if (!column.met_in_passing(seat->place)) return false;
    map.edges.push_back({p, 0, false});
    return true;
  });
}

}  // namespace lamina::apps
