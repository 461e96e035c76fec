// Rims, their shadows, and what looks say of these.
#include <lamina/grid/evidence/overhangs.hpp>

#include <algorithm>
#include <bitset>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <lamina/grid/evidence/hidden_places.hpp>
#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kClearance = 0.1;  // m between a rim and its floor
// m of a rim: what is higher is the face of a thing. Outlines are squares of 0.1 m: a plane made of
// a board's edge of 5 cm may be 0.2 m high in the map.
constexpr double kThickest = 0.25;
constexpr int kMostCells = 100;      // kLength is, of the finest grid
constexpr double kLength = 0.2;      // m of a rim, at the least
constexpr double kSameRim = 0.1;     // m of height
constexpr double kDeepest = 1;       // m from a rim: boards and tops are no deeper
constexpr double kNarrowest = 0.25;  // m from a rim to the one across
constexpr double kBehind = 0.2;      // m behind a rim, at the least, where floor must show
constexpr std::size_t kWays = 180;   // directions: at 1 m their lines are less than a cell apart
constexpr std::size_t kAlike = 3;    // of these to either side that see the same

double heading_of(std::size_t way) {
  return (static_cast<double>(way) + 0.5) * 2 * M_PI / static_cast<double>(kWays);
}
std::size_t way_of(const Eigen::Vector2d& d) {
  const double turn = std::atan2(d.y(), d.x()) / (2 * M_PI);
  return static_cast<std::size_t>(
             std::floor((turn - std::floor(turn)) * static_cast<double>(kWays))) %
         kWays;
}

struct Rim {
  CellIndex cell;
  double floor = 0;  // map z
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  // Headings of lines of sight that met it, and that met the floor behind it.
  std::bitset<kWays> met, under;

  /// Behind a wall nobody sees floor from before it.
  bool seen_along(std::size_t way) const {
    bool below = false;
    for (std::size_t k = 0; k <= 2 * kAlike; ++k) {
      below = below || under[(way + kWays + k - kAlike) % kWays];
    }
    return met[way] && below;
  }

  void meet_from(const Eigen::Vector3d& from_map) { met.set(way_of((p_map - from_map).head<2>())); }
};

// What a look says of a rim, and of the floor behind it: further than what it may mistake for it.
void ask_rim(Rim& rim, const DepthLook& look, const SE3& T_map_camera, const SE3& T_camera_map) {
  const Eigen::Vector3d p_camera = T_camera_map * rim.p_map;
  if (look.at(p_camera, kLookRadius) == Sight::kMet) rim.meet_from(T_map_camera.translation());
  const Eigen::Vector2d along = (rim.p_map - T_map_camera.translation()).head<2>().normalized();
  const double behind = std::max(kBehind, 1.25 * look.margin(std::max(0.0, p_camera.z())));
  const Eigen::Vector2d floor = rim.p_map.head<2>() + behind * along;
  if (look.at(T_camera_map * Eigen::Vector3d(floor.x(), floor.y(), rim.floor), kLookRadius) ==
      Sight::kMet)
    rim.under.set(way_of(along));
}

class Shadows {
 public:
  Shadows(const std::vector<SolidCell>& solid, double resolution) : resolution_(resolution) {
    for (const SolidCell& s : solid) solid_.emplace(s.cell, s);
    const int n = to_whole(std::ceil(kLength / resolution), 1, kMostCells);
    for (const SolidCell& s : solid) {
      if (!is_rim(s)) continue;
      int beside = 0;
      for (int dj = -n; dj <= n; ++dj) {
        for (int di = -n; di <= n; ++di) {
          const SolidCell* other = at({s.cell.i + di, s.cell.j + dj});
          beside += other != nullptr && is_rim(*other) && std::abs(other->low - s.low) <= kSameRim;
        }
      }
      if (beside * resolution < kLength) continue;
      const Eigen::Vector2d c = center_of(s.cell, resolution);
      Rim& rim = rims.emplace_back();
      rim.cell = s.cell;
      rim.floor = s.floor;
      rim.p_map = {c.x(), c.y(), (s.low + s.high) / 2};
    }
  }

  // visit(cell) from behind the rim on, as long as it returns true.
  template <class Visit>
  void walk(const Rim& rim, std::size_t way, const Visit& visit) const {
    const double heading = heading_of(way);
    const Eigen::Vector2d along(std::cos(heading), std::sin(heading));
    CellIndex last = rim.cell;
    for (double s = resolution_ / 2; s <= kDeepest; s += resolution_ / 2) {
      const CellIndex cell = cell_of(rim.p_map.head<2>() + s * along, resolution_);
      if (cell == last) continue;
      last = cell;
      const SolidCell* there = at(cell);
      if (there != nullptr && there->high > rim.p_map.z() - kSameRim) {
        if (!is_rim(*there) || s >= kNarrowest) return;  // a wall, or the rim across
        continue;
      }
      if (!visit(cell)) return;
    }
  }

  std::vector<Rim> rims;

 private:
  static bool is_rim(const SolidCell& s) {
    return s.low > s.floor + kClearance && s.high <= s.low + kThickest;
  }
  const SolidCell* at(const CellIndex& cell) const {
    const auto found = solid_.find(cell);
    return found == solid_.end() ? nullptr : &found->second;
  }
  double resolution_;
  std::map<CellIndex, SolidCell> solid_;
};

// Looks lack what is thinner than their squares; scans made of images end at it.
void meet_by_scans(const ForEachScan& for_each_scan, const Trajectory& path, double resolution,
                   std::vector<Rim>& rims) {
  if (!for_each_scan || rims.empty()) return;
  std::map<CellIndex, Rim*> rim_at;
  for (Rim& rim : rims) rim_at.emplace(rim.cell, &rim);
  for_each_scan([&](const KeptScan& kept) {
    const LaserScan& scan = kept.scan;
    const auto T_map_body = path.at(scan.stamp);
    if (!kept.from_depth || !T_map_body) return;
    const SE3 T_map_scan = *T_map_body * scan.lidar.T_body_lidar;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (!scan.valid(i)) continue;
      const Eigen::Vector2d p = scan.point(i);
      const Eigen::Vector3d end = T_map_scan * Eigen::Vector3d(p.x(), p.y(), 0);
      const auto rim = rim_at.find(cell_of(end.head<2>(), resolution));
      if (rim != rim_at.end()) rim->second->meet_from(T_map_scan.translation());
    }
  });
}

}  // namespace

std::vector<CellIndex> hidden_behind(const std::vector<SolidCell>& solid, const Spool& looks,
                                     const Trajectory& trajectory, double resolution,
                                     const ForEachScan& for_each_scan) {
  if (looks.size() == 0) return {};
  Shadows shadows(solid, resolution);
  if (shadows.rims.empty()) return {};
  ask(looks, trajectory, shadows.rims, ask_rim);
  meet_by_scans(for_each_scan, trajectory, resolution, shadows.rims);
  const auto for_each_line = [&](const auto& visit) {
    for (const Rim& rim : shadows.rims) {
      for (std::size_t way = 0; way < kWays; ++way) {
        if (!rim.seen_along(way)) continue;
        shadows.walk(rim, way, [&](const CellIndex& cell) { return visit(rim, cell); });
      }
    }
  };
  // By cell and height: shadows of boards lie over each other.
  std::map<std::pair<CellIndex, std::int64_t>, std::size_t> place_of;
  const auto key = [](const Rim& rim, const CellIndex& cell) {
    return std::pair(cell, to_far_cell(rim.p_map.z() / kSameRim));
  };
  std::vector<HiddenPlace> places;
  for_each_line([&](const Rim& rim, const CellIndex& cell) {
    const Eigen::Vector2d c = center_of(cell, resolution);
    if (place_of.try_emplace(key(rim, cell), places.size()).second)
      places.push_back({{c.x(), c.y(), rim.p_map.z()}, rim.floor, 0});
    return true;
  });
  look_past(looks, trajectory, places);
  std::set<CellIndex> hidden;
  for_each_line([&](const Rim& rim, const CellIndex& cell) {
    const bool seen = places[place_of.at(key(rim, cell))].past >= kLooksPast;
    if (!seen) hidden.insert(cell);
    return !seen;
  });
  return {hidden.begin(), hidden.end()};
}

void hide(NavigabilityGrid& grid, const std::vector<CellIndex>& cells) {
  for (const CellIndex& c : cells) {
    NavigabilityCell* cell = grid.find(c);
    if (cell == nullptr || !(cell->navigability > 0)) continue;
    cell->navigability = cell->confidence = NavigabilityCell::kUnknown;
  }
}

}  // namespace lamina
