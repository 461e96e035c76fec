// Votes for and against each place.
#include <lamina/grid/evidence/ground_evidence.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include <lamina/grid/evidence/ground_surfaces.hpp>
#include <lamina/grid/evidence/looks_archive.hpp>
#include <lamina/grid/grid_geometry.hpp>
#include <lamina/models/checked_cast.hpp>
#include <lamina/models/model_archive.hpp>

namespace lamina {
namespace {

constexpr int kLooks = 3;             // that mark a place
constexpr double kAsNear = 1.5;       // times the nearest range: looks that see as well
constexpr int kClose = 2;             // cells
constexpr double kStorey = 0.5;       // m: places further above each other are not one
constexpr double kLean = 0.015;       // m that a look's floor is off the map's, within its reach
constexpr double kSameGround = 0.05;  // m between a look's floor and the map's

struct Mark {
  double range = 0, height = 0, sigma = 0;
  Eigen::Vector3d floor_map = Eigen::Vector3d::Zero();  // under (over) it
};

// Marks of one kind, raised or sunk.
struct Side {
  std::vector<Mark> marks;
  double nearest = std::numeric_limits<double>::infinity();
  int floors = 0;

  void add(const Mark& mark) {
    marks.push_back(mark);
    nearest = std::min(nearest, mark.range);
  }
  bool counts() const {
    const int n = static_cast<int>(marks.size());
    return n >= kLooks && floors < n;
  }
  // What the looks from near say together.
  Mark together() const {
    Mark sum;
    double weight = 0;
    for (const Mark& mark : marks) {
      if (mark.range > kAsNear * nearest) continue;
      const double w = 1 / std::max(mark.sigma * mark.sigma, 1e-8);
      weight += w;
      sum.height += w * mark.height;
      sum.floor_map += w * mark.floor_map;
    }
    sum.height /= weight;
    sum.floor_map /= weight;
    sum.sigma = std::sqrt(1 / weight);
    return sum;
  }
};

struct Place {
  Side raised, sunk;
  // On the floor's plane, not far from where floor is not; looks that saw floor here nevertheless.
  std::optional<Eigen::Vector3d> beside_sunk_map;
  int floors_beside = 0;
};

struct PlaceKey {
  CellIndex cell;
  int storey = 0;
  bool operator<(const PlaceKey& o) const {
    return std::pair(storey, cell) < std::pair(o.storey, o.cell);
  }
};

SeenGround look_of(std::string_view bytes) {
  SeenGround seen;
  ArchiveReader archive(bytes);
  archive(seen);
  return seen;
}

std::string bytes_of(const SeenGround& seen) {
  ArchiveWriter archive;
  archive(seen);
  return archive.bytes();
}

using Places = std::map<PlaceKey, Place>;

void add_marks(const SeenGround& seen, const SE3& T_map_levelled, double resolution,
               Places& places) {
  for (const GroundMark& mark : seen.look.marks) {
    const Eigen::Vector2d xy = mark.xy.cast<double>();
    const Eigen::Vector3d p = T_map_levelled * Eigen::Vector3d(xy.x(), xy.y(), 0);
    const PlaceKey key{cell_of(p.head<2>(), resolution), to_cell(std::round(p.z() / kStorey))};
    Place& place = places[key];
    const auto height = static_cast<double>(mark.height);
    (height > 0 ? place.raised : place.sunk)
        .add({xy.norm(), height, static_cast<double>(mark.sigma), p});
  }
}

// Holes are seen in part: what nobody saw as floor close by is none either.
void spread_sunk(double resolution, double max_step, Places& places) {
  std::vector<std::pair<PlaceKey, double>> sunk;
  for (const auto& [key, place] : places) {
    if (!place.sunk.counts()) continue;
    const Mark mark = place.sunk.together();
    if (mark.height < -max_step) sunk.emplace_back(key, mark.floor_map.z());
  }
  for (const auto& [key, z] : sunk) {
    for (int dj = -kClose; dj <= kClose; ++dj) {
      for (int di = -kClose; di <= kClose; ++di) {
        const PlaceKey beside{{key.cell.i + di, key.cell.j + dj}, key.storey};
        const Eigen::Vector2d xy = center_of(beside.cell, resolution);
        places[beside].beside_sunk_map = {xy.x(), xy.y(), z};
      }
    }
  }
}

bool sees_floor(const SeenGround& seen, const Eigen::Vector3d& p_levelled) {
  const double range = p_levelled.head<2>().norm();
  return std::abs(p_levelled.z()) <= kSameGround + 0.05 * range &&
         seen.look.floor_at(p_levelled.head<2>());
}

// Looks at places that others marked, and that see floor there.
void add_floors(const SeenGround& seen, const SE3& T_levelled_map, double farthest,
                Places& places) {
  for (auto& [key, place] : places) {
    for (Side* side : {&place.raised, &place.sunk}) {
      if (side->marks.empty()) continue;
      const Eigen::Vector3d p = T_levelled_map * side->marks.front().floor_map;
      const double range = p.head<2>().norm();
      if (range > farthest || range > kAsNear * side->nearest) continue;
      side->floors += sees_floor(seen, p);
    }
    if (place.beside_sunk_map && place.floors_beside == 0) {
      place.floors_beside += sees_floor(seen, T_levelled_map * *place.beside_sunk_map);
    }
  }
}

}  // namespace

void GroundVotes::take(const std::vector<SeenGround>& seen) {
  looks_.clear();
  for (const SeenGround& look : seen) looks_.add(bytes_of(look));
}

void GroundVotes::add(Timestamp stamp, const GroundLook& look, const SE3& T_body_levelled) {
  if (!look.empty()) looks_.add(bytes_of({stamp, T_body_levelled, look}));
}

void GroundVotes::put_into(PlanarMap& map, const Trajectory& trajectory, double resolution,
                           double max_step) const {
  Places places;
  const auto for_each_look = [&](const auto& visit) {
    looks_.for_each([&](std::string_view bytes) {
      const SeenGround seen = look_of(bytes);
      const auto T_map_body = trajectory.at(seen.stamp);
      if (T_map_body) visit(seen, *T_map_body * seen.T_body_levelled);
    });
  };
  for_each_look([&](const SeenGround& seen, const SE3& T_map_levelled) {
    add_marks(seen, T_map_levelled, resolution, places);
  });
  std::erase_if(places, [](const auto& item) {
    return !item.second.raised.counts() && !item.second.sunk.counts();
  });
  spread_sunk(resolution, max_step, places);
  for_each_look([&](const SeenGround& seen, const SE3& T_map_levelled) {
    const double farthest =
        static_cast<double>(seen.look.cell_m) * std::hypot(seen.look.nx, seen.look.ny);
    add_floors(seen, T_map_levelled.inverse(), farthest, places);
  });
  const GroundHits ground(map.planes, GroundHits::Of::kAnyMap);
  for (const auto& [key, place] : places) {
    if (place.raised.counts()) {
      Mark mark = place.raised.together();
      // Looks lean by what their own floor leaves open; the map's floor does not.
      mark.floor_map.z() = ground.nearest(mark.floor_map, kLean).value_or(mark.floor_map.z());
      const Eigen::Vector3d up(0, 0, mark.height);
      map.loose_points.push_back(mark.floor_map + up);
      map.loose_points.push_back(mark.floor_map + 0.5 * up);
    }
    if (place.sunk.counts()) {
      const Mark mark = place.sunk.together();
      if (mark.height < -max_step) map.edges.push_back({mark.floor_map, 0, false});
    } else if (place.beside_sunk_map && place.floors_beside == 0) {
      map.edges.push_back({*place.beside_sunk_map, 0, false});
    }
  }
}

}  // namespace lamina
