// Places of the map, and what every look says of those in its reach.
#include <lamina/grid/evidence/dynamic_removal.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <lamina/grid/evidence/dynamic_objects.hpp>
#include <lamina/grid/evidence/ground_surfaces.hpp>
#include <lamina/grid/evidence/looks_archive.hpp>
#include <lamina/grid/evidence/occupancy_column.hpp>
#include <lamina/grid/evidence/plane_visibility.hpp>
#include <lamina/grid/evidence/scan_visibility.hpp>
#include <lamina/models/checked_cast.hpp>
#include <lamina/models/model_archive.hpp>
#include <lamina/models/ordered_parallel.hpp>

namespace lamina {
namespace {

constexpr double kInterval = kLookInterval;  // between scans, too
constexpr double kRadius = 0.06;    // m about a place: half a cell's diagonal, and poses' errors
constexpr double kLevel = 0.1;      // m of height that loose points share
constexpr int kBelow = 6;           // levels
constexpr double kFarthest = 8;     // m
constexpr double kUpright = 0.5;    // |n.z| below
constexpr double kPerson = 1;       // m^2 of a plane: no person is larger
constexpr std::size_t kFewest = 2;  // squares
constexpr std::size_t kTrust = 10;  // one in so many squares of large planes may be no wall

std::string bytes_of(const SeenDepth& seen) {
  ArchiveWriter archive;
  archive(seen);
  return archive.bytes();
}

// How far from the camera it met anything, at the image's corners, too.
double reach_of(const DepthLook& look) {
  const auto most = std::max_element(look.reach.begin(), look.reach.end());
  if (most == look.reach.end()) return 0;
  const double z = DepthLook::depth(*most);
  const auto slope = [](float f, float c, std::int32_t n) {
    const auto middle = static_cast<double>(c);
    return std::max(middle, n - middle) / static_cast<double>(f);
  };
  const double slant =
      Eigen::Vector3d(slope(look.fx, look.cx, look.nx), slope(look.fy, look.cy, look.ny), 1).norm();
  return std::min(kFarthest, slant * (z + look.margin(z)));
}

// Whether a look may see anything of a sphere, in the camera's frame: no face of its pyramid leaves
// all of it out.
bool may_see(const DepthLook& look, const Eigen::Vector3d& p, double radius) {
  if (!(p.z() > -radius)) return false;
  const auto within = [&](float f, float c, std::int32_t n, double x) {
    const double focal = static_cast<double>(f), low = static_cast<double>(c), high = n - low;
    return focal * x + low * p.z() >= -radius * std::hypot(focal, low) &&
           high * p.z() - focal * x >= -radius * std::hypot(focal, high);
  };
  return within(look.fx, look.cx, look.nx, p.x()) && within(look.fy, look.cy, look.ny, p.y());
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
    const auto index = [](double x, double size) { return to_far_cell(x / size); };
    return {index(p.x(), resolution_), index(p.y(), resolution_), index(p.z(), kLevel)};
  }
  double resolution_;
  std::map<Key, Seat> seats_;
};

// What a look says of the places of a column: those of Seen from `first` on.
struct ColumnSight {
  PlaceColumn* column = nullptr;
  std::size_t first = 0;
};
// Columns of which it says something.
struct Seen {
  Timestamp stamp;
  double pixel = 0;  // m per m of depth
  std::vector<ColumnSight> columns;
  std::vector<PlaceSight> places;

  std::span<const PlaceSight> of(const ColumnSight& sight) const {
    return {places.data() + sight.first, sight.column->size()};
  }
};

// Asks every look, and every scan that is no look made flat, of the places in its reach.
class Observers {
 public:
  Observers(const Spool& looks, const SightVotes::ForEachScan& scans, const Trajectory& path,
            int threads)
      : looks_(looks), scans_(scans), path_(path), threads_(threads) {}

  /// take(Seen), in order; what they see is worked out by all threads.
  template <class Take>
  void ask(PlaceColumns& columns, const Take& take) const {
    constexpr std::size_t kEach = 8;  // what each sees is large
    OrderedBatch<Asked> batch(threads_, kEach);
    const auto run = [&] {
      batch.run([&](Asked& asked, std::size_t) { answer(columns, asked); },
                [&](const Asked& asked) {
                  if (asked.placed) take(asked.seen);
                });
    };
    const auto add = [&](Asked asked) {
      batch.add(std::move(asked));
      if (batch.full()) run();
    };
    looks_.for_each([&](std::string_view bytes) { add({.look = std::string(bytes)}); });
    std::optional<Timestamp> last;
    if (scans_) {
      scans_([&](const KeptScan& kept) {
        const LaserScan& scan = kept.scan;
        if (kept.from_depth || (last && std::abs(scan.stamp - *last) < kInterval)) return;
        last = scan.stamp;
        add({.scan = scan});
      });
    }
    run();
  }

 private:
  struct Asked {
    std::string look = {};               // its archive; empty: a scan
    std::optional<LaserScan> scan = {};  // otherwise
    Seen seen = {};
    bool placed = false;  // the path says where it was
  };

  void answer(PlaceColumns& columns, Asked& asked) const {
    asked.placed = asked.scan ? look_by_scan(columns, *asked.scan, asked.seen)
                              : look_by_image(columns, asked.look, asked.seen);
  }

  bool look_by_image(PlaceColumns& columns, const std::string& bytes, Seen& seen) const {
    SeenDepth depth;
    ArchiveReader archive(bytes);
    archive(depth);
    const DepthLook& look = depth.look;
    const double square = 1 / static_cast<double>(std::min(look.fx, look.fy));
    seen.stamp = depth.stamp;
    seen.pixel = look.pixel;
    return ask_near(
        columns, depth.T_body_camera, reach_of(look), seen,
        [&look](const Eigen::Vector3d& p, double radius) { return may_see(look, p, radius); },
        [&look, square](const Eigen::Vector3d& p) {
          return PlaceSight{look.at(p, kRadius), p.z(), kRadius + square * p.z()};
        });
  }

  bool look_by_scan(PlaceColumns& columns, const LaserScan& scan, Seen& seen) const {
    seen.stamp = scan.stamp;
    seen.pixel = scan.angle_increment;
    return ask_near(
        columns, scan.lidar.T_body_lidar, kFarthest, seen,
        [](const Eigen::Vector3d& p, double radius) { return std::abs(p.z()) <= radius; },
        [&scan](const Eigen::Vector3d& p) {
          return PlaceSight{sight_of(scan, p, kRadius), p.head<2>().norm(), kRadius};
        });
  }

  template <class InView, class SightOf>
  bool ask_near(PlaceColumns& columns, const SE3& T_body_sensor, double reach, Seen& seen,
                const InView& in_view, const SightOf& sight_of_place) const {
    const auto T_map_body = path_.at(seen.stamp);
    if (!T_map_body) return false;
    const SE3 T_map_sensor = *T_map_body * T_body_sensor, T_sensor_map = T_map_sensor.inverse();
    columns.for_each_near(T_map_sensor.translation(), reach, [&](PlaceColumn& column) {
      const Eigen::Vector3d first = column.at_map(0), last = column.at_map(column.size() - 1);
      const double radius = 0.5 * (last - first).norm() + kRadius;
      if (!in_view(T_sensor_map * Eigen::Vector3d(0.5 * (first + last)), radius)) return;
      const std::size_t begin = seen.places.size();
      bool any = false;
      for (std::size_t k = 0; k < column.size(); ++k) {
        seen.places.push_back(sight_of_place(T_sensor_map * column.at_map(k)));
        any = any || seen.places.back().sight != Sight::kUnknown;
      }
      if (any) {
        seen.columns.push_back({&column, begin});
      } else {
        seen.places.resize(begin);
      }
    });
    return true;
  }

  const Spool& looks_;
  const SightVotes::ForEachScan& scans_;
  const Trajectory& path_;
  int threads_;
};

// Laid where it was made: of the large walls in its view, as others met them, it went past less
// than one square in kTrust.
bool laid_right(const Seen& seen) {
  std::size_t met = 0, past = 0;
  for (const ColumnSight& sight : seen.columns) {
    if (!sight.column->wall) continue;
    const auto places = seen.of(sight);
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (!sight.column->met(k)) continue;
      met += places[k].sight == Sight::kMet;
      past += places[k].sight == Sight::kPast;
    }
  }
  return kTrust * past <= met + past;
}

// Asks all looks who met what, who went past, and what was met beside what had gone.
void ask_all(const Observers& observers, PlaceColumns& columns) {
  observers.ask(columns, [](const Seen& seen) {
    for (const ColumnSight& sight : seen.columns) sight.column->meet(seen.stamp, seen.of(sight));
  });
  observers.ask(columns, [](const Seen& seen) {
    if (!laid_right(seen)) return;
    for (const ColumnSight& sight : seen.columns)
      sight.column->pass(seen.stamp, seen.of(sight), seen.pixel);
  });
  Movers movers;
  std::vector<MetPlace> met;
  observers.ask(columns, [&](const Seen& seen) {
    met.clear();
    for (const ColumnSight& sight : seen.columns) {
      const auto places = seen.of(sight);
      for (std::size_t k = 0; k < places.size(); ++k) {
        if (places[k].sight == Sight::kMet) met.push_back({sight.column, k});
      }
    }
    movers.add(seen.stamp, met);
  });
  movers.finish();
}

}  // namespace

void SightVotes::take(const std::vector<SeenDepth>& seen) {
  looks_.clear();
  for (const SeenDepth& look : seen) looks_.add(bytes_of(look));
}

void SightVotes::add(Timestamp stamp, const DepthLook& look, const SE3& T_body_camera) {
  if (look.empty() || (last_ && stamp - *last_ < kInterval)) return;
  last_ = stamp;
  looks_.add(bytes_of({stamp, T_body_camera, look}));
}

void SightVotes::withdraw(PlanarMap& map, const Trajectory& trajectory, double resolution,
                          const ForEachScan& for_each_scan, int threads) const {
  if (looks_.size() == 0) return;
  PlaceColumns columns;
  const LoosePoints loose(map.loose_points, resolution, columns);
  std::map<std::int64_t, PlaneSquares> squares;  // by the plane's id
  for (const MapPlane& plane : map.planes) {
    if (std::abs(plane.plane_map.normal().z()) < kUpright)
      squares.try_emplace(plane.id, plane, plane.area > kPerson, columns);
  }
  if (columns.empty()) return;
  ask_all({looks_, for_each_scan, trajectory, threads}, columns);
  const GroundHits ground(map.planes, GroundHits::Of::kAnyMap);
  PlaneSquares::Count large;
  for (const MapPlane& plane : map.planes) {
    const auto at = squares.find(plane.id);
    if (at == squares.end() || plane.area <= kPerson) continue;
    const auto found = at->second.count(columns, ground);
    large.no_wall += found.no_wall;
    large.stands += found.moved_along + found.stands;
  }
  // No person, but walls that poses drew twice: this path cannot tell what went away.
  if (kTrust * large.no_wall > large.no_wall + large.stands) return;
  std::vector<MapPlane> left;
  for (MapPlane& plane : map.planes) {
    const auto at = squares.find(plane.id);
    if (at != squares.end() && plane.area <= kPerson) {
      const auto found = at->second.count(columns, ground);
      const bool suspected = found.no_wall + found.moved_along >= kFewest;
      if (suspected && found.gone()) {
        at->second.add_ends(columns, map.edges);
        continue;
      }
      if (suspected) at->second.cut(plane, columns, ground, map.edges);
    } else if (at != squares.end()) {
      at->second.open_where_driven(plane, columns, ground, trajectory);
    }
    left.push_back(std::move(plane));
  }
  map.planes = std::move(left);
  std::erase_if(map.loose_points, [&](const Eigen::Vector3d& p) {
    const Seat* seat = loose.seat(p);
    if (seat == nullptr) return false;
    const PlaceColumn& column = columns[seat->column];
    if (column.free_again(seat->place) || column.outvoted(seat->place)) return true;
    if (!column.met_in_passing(seat->place) && !column.moved_along(seat->place)) return false;
    map.edges.push_back({p, 0, false});
    return true;
  });
}

}  // namespace lamina
