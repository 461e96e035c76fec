// Footprints and digests of evidence.
#include <lamina/grid/raster_book.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

#include <lamina/grid/raster_shapes.hpp>
#include <lamina/models/checked_cast.hpp>
#include <lamina/models/error.hpp>

namespace lamina::raster {
namespace {

constexpr double kSeedEvery = 0.25;      // m of the path
constexpr double kReferenceEvery = 2.0;  // m
constexpr double kFarthest = 2e9;  // cells, what 32 bits hold: UTM reaches 1e7 m, 1e9 cells of 1 cm
constexpr std::int64_t kMostTiles = 1 << 20;

struct Digest {
  std::uint64_t value = 0x9E3779B97F4A7C15ULL;
  void add(double x) {
    value = (value ^ std::bit_cast<std::uint64_t>(x)) * 0xD6E8FEB86659FD93ULL;
    value ^= value >> 32;
  }
  template <class Derived>
  void add(const Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) {
      for (Eigen::Index i = 0; i < m.rows(); ++i) add(m(i, j));
    }
  }
};

}  // namespace

Book::Item Book::covering(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                          double margin) const {
  Item item;
  const double side = options_.resolution * kSide, far = kFarthest * options_.resolution;
  const Eigen::Vector2d a = low.array() - margin, b = high.array() + margin;
  if (!a.allFinite() || !b.allFinite() || a.minCoeff() < -far || b.maxCoeff() > far) return item;
  if ((a.array() > b.array()).any()) return item;  // of nothing at all
  const auto tile = [side](double x) { return to_cell(x / side); };
  const Item covers{0, tile(a.x()), tile(a.y()), tile(b.x()), tile(b.y())};
  const std::int64_t count =
      (std::int64_t{covers.i1} - covers.i0 + 1) * (std::int64_t{covers.j1} - covers.j0 + 1);
  return count <= kMostTiles ? covers : item;
}

Book::Item Book::item(const Surfel& s) const {
  if (!s.normal.allFinite() || !s.covariance.allFinite() || !std::isfinite(s.center.z())) return {};
  const Eigen::Vector2d c = s.center.head<2>();
  // Planes ask how far the nearest disc is.
  Item result =
      covering(c, c, s.radius * options_.disc_growth + options_.plane_ring + options_.resolution);
  Digest d;
  d.add(s.center);
  d.add(s.normal);
  d.add(s.radius);
  d.add(s.covariance);
  d.add(static_cast<double>(s.parent_plane));
  result.digest = d.value;
  result.plane = s.parent_plane;
  return result;
}

Book::Item Book::item(const MapPlane& plane) const {
  Eigen::Vector2d low(1e300, 1e300), high(-1e300, -1e300);
  Digest d;
  d.add(static_cast<double>(plane.id));
  d.add(plane.plane_map.normal());
  d.add(plane.plane_map.rho());
  d.add(plane.centroid_map);
  d.add(plane.covariance);
  bool sound = plane.centroid_map.allFinite() && plane.covariance.allFinite();
  for (const auto& outline : plane.outlines_map) {
    d.add(static_cast<double>(outline.size()));
    for (const Eigen::Vector3d& p : outline) {
      sound = sound && p.allFinite();
      low = low.cwiseMin(p.head<2>());
      high = high.cwiseMax(p.head<2>());
      d.add(p);
    }
  }
  // Walls bar the way to what lies behind them, in the next tile too.
  const double reach = options_.resolution + (is_steep(plane) ? wall_reach(options_) : 0.0);
  Item result = sound ? covering(low, high, reach) : Item{};
  result.digest = d.value;
  result.plane = plane.id;
  return result;
}

Book::Item Book::item(const EdgePoint& edge) const {
  const Eigen::Vector2d p = edge.position_map.head<2>();
  Item result = covering(p, p, std::max(edge.sigma, options_.resolution));
  Digest d;
  d.add(p);
  d.add(edge.sigma);
  d.add(edge.negative ? 1.0 : 0.0);
  result.digest = d.value;
  return result;
}

Book::Item Book::item(const Eigen::Vector3d& point) const {
  if (!std::isfinite(point.z())) return {};
  const Eigen::Vector2d p = point.head<2>();
  Item result = covering(p, p, options_.resolution);  // a point counts for its neighbours' pairs
  Digest d;
  d.add(point);
  result.digest = d.value;
  return result;
}

void Book::mark(Tile& tile, bool Tile::*what) {
  if (!tile.waiting) marked.push_back(&tile);
  tile.waiting = true;
  tile.*what = true;
}

void Book::place(Kind& kind, std::size_t index, const Item& item) {
  if (index >= kind.items.size()) kind.items.resize(index + 1);
  Item& old = kind.items[index];
  const bool stays =
      old.i0 == item.i0 && old.j0 == item.j0 && old.i1 == item.i1 && old.j1 == item.j1;
  const auto k = static_cast<std::int32_t>(index);
  for (std::int32_t j = old.j0; j <= old.j1 && !stays; ++j) {
    for (std::int32_t i = old.i0; i <= old.i1; ++i) {
      Tile& tile = *tiles.at({j, i});
      auto& list = tile.*kind.list;
      list.erase(std::lower_bound(list.begin(), list.end(), k));
      mark(tile, kind.mark);
    }
  }
  for (std::int32_t j = item.j0; j <= item.j1; ++j) {
    for (std::int32_t i = item.i0; i <= item.i1; ++i) {
      auto& tile = tiles[{j, i}];
      if (!tile) {
        tile = std::make_unique<Tile>();
        tile->first = {i * kSide, j * kSide};
      }
      auto& list = (*tile).*kind.list;
      if (!stays) list.insert(std::lower_bound(list.begin(), list.end(), k), k);
      mark(*tile, kind.mark);
    }
  }
  if (&kind == &surfels_ && old.plane != item.plane) adopt(old.plane, item.plane);
  old = item;
}

void Book::adopt(std::int64_t from, std::int64_t to) {
  if (from >= 0 && --surfels_of[from] == 0) {
    surfels_of.erase(from);
    adopted_.insert(from);
  }
  if (to >= 0 && ++surfels_of[to] == 1) adopted_.insert(to);
}

void Book::mark_adopted() {
  if (adopted_.empty()) return;
  for (const Item& item : planes_.items) {
    if (!adopted_.contains(item.plane)) continue;
    for (std::int32_t j = item.j0; j <= item.j1; ++j) {
      for (std::int32_t i = item.i0; i <= item.i1; ++i) mark(*tiles.at({j, i}), planes_.mark);
    }
  }
  adopted_.clear();
}

void Book::cut(Kind& kind, std::size_t size) {
  while (kind.items.size() > size) {
    place(kind, kind.items.size() - 1, Item{});
    kind.items.pop_back();
  }
}

template <class T>
void Book::compare(Kind& kind, const std::vector<T>& list, std::size_t from) {
  cut(kind, list.size());
  for (std::size_t k = from; k < list.size(); ++k) {
    const Item now = item(list[k]);
    if (k < kind.items.size() && kind.items[k].digest == now.digest) continue;
    place(kind, k, now);
  }
}

template <class T>
void Book::compare(Kind& kind, const std::vector<T>& list, const std::vector<std::size_t>& listed) {
  cut(kind, list.size());
  const std::size_t appended = kind.items.size();
  for (const std::size_t k : listed) {
    LAMINA_CHECK(k < list.size());
    const Item now = item(list[k]);
    if (k < appended && kind.items[k].digest != now.digest) place(kind, k, now);
  }
  compare(kind, list, appended);
}

void Book::follow(const Trajectory& path, bool from_start) {
  if (from_start || path.size() < followed_) {
    followed_ = 0;
    seeds.clear();
    references.clear();
  }
  const auto keep = [](std::vector<PathPoint>& kept, const Eigen::Vector3d& p, double every) {
    if (kept.empty() || (kept.back().position_map - p).norm() >= every) kept.push_back({p});
  };
  for (; followed_ < path.size(); ++followed_) {
    const Eigen::Vector3d p = path[followed_].pose.translation();
    if (!p.allFinite()) continue;
    keep(seeds, p, kSeedEvery);
    keep(references, p, kReferenceEvery);
  }
  place_path();
}

void Book::place_path() {
  const auto one = [this](Kind& kind, const std::vector<PathPoint>& kept, double reach) {
    cut(kind, kept.size());
    for (std::size_t k = 0; k < kept.size(); ++k) {
      Digest d;
      d.add(kept[k].position_map);
      if (k < kind.items.size() && kind.items[k].digest == d.value) continue;
      const Eigen::Vector2d p = kept[k].position_map.head<2>();
      Item now = covering(p, p, reach);
      now.digest = d.value;
      place(kind, k, now);
    }
  };
  one(seeds_, seeds, options_.seed_radius);
  one(references_, references, options_.reference_reach);
}

void Book::update(const PlanarMap& map) {
  compare(surfels_, map.surfels, std::size_t{0});
  compare(planes_, map.planes, std::size_t{0});
  compare(edges_, map.edges, std::size_t{0});
  compare(points_, map.loose_points, std::size_t{0});
  mark_adopted();
  follow(map.trajectory, true);
}

void Book::update(const PlanarMap& map, const RasterChanges& changes) {
  compare(surfels_, map.surfels, changes.surfels);
  compare(planes_, map.planes, changes.planes);
  compare(edges_, map.edges, changes.edges);
  compare(points_, map.loose_points, changes.loose_points);
  mark_adopted();
  follow(map.trajectory, false);
}

}  // namespace lamina::raster
