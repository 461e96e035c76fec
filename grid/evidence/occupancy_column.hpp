// Votes of looks on what stands at places of the map: was it met there, and did lines of sight go
// past since?
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <lamina/models/depth_look.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

/// What one look says of a place, from how far, and how far from it what it met may lie.
struct PlaceSight {
  Sight sight = Sight::kUnknown;
  double depth = 0;  ///< m
  double blur = 0;   ///< m
};

/// Places above each other, lowest first. All looks are asked twice: first who met them, then who
/// went past.
class PlaceColumn {
 public:
  /// A look that sees no finer than this (m a pixel) takes away only what it, or one from no nearer
  /// than two thirds of its depth, met: thin things are missed from afar.
  explicit PlaceColumn(double finest = 0.01) : finest_(finest) {}

  void add(const Eigen::Vector3d& p_map) { places_.emplace_back().p_map = p_map; }
  std::size_t size() const { return places_.size(); }
  const Eigen::Vector3d& at_map(std::size_t k) const { return places_[k].p_map; }

  /// `sights`: of all places.
  void meet(Timestamp stamp, std::span<const PlaceSight> sights);
  /// `pixel`: what one spans, m per m of depth.
  void pass(Timestamp stamp, std::span<const PlaceSight> sights, double pixel);

  /// Of a large wall: what others met of it tells whether a look is laid where it was made.
  bool wall = false;

  /// One of the looks that met it met movers beside it (movers.hpp).
  void count_beside(std::size_t k) { ++places_[k].beside; }

  /// s, from the first look that met it to the last.
  double met_for(std::size_t k) const {
    return 1e-9 * static_cast<double>(places_[k].last - places_[k].first);
  }
  bool met(std::size_t k) const { return places_[k].met > 0; }
  /// Three looks went past it since the last that met it; or past a place below since then, with
  /// which it was met (by a look that tells the two apart), and which no look went past while it
  /// met this: what stood on it is gone, what hangs over it is not.
  bool free_again(std::size_t k) const;
  /// Not free again as nobody looked, but met within less than a second in all, where three times
  /// as many looks had gone past before.
  bool met_in_passing(std::size_t k) const;
  /// Not free again as nobody looked, but never met without something beside it that has gone.
  bool moved_along(std::size_t k) const;
  /// Of the looks from near, which see it best, three and more than met it went past it since it
  /// was first met: what those from afar met lies beside it. What was put down is never gone past.
  bool outvoted(std::size_t k) const;
  /// Free again, or met by no more looks (of three or more) than had gone past before: no wall.
  bool no_wall(std::size_t k) const;

 private:
  static constexpr int kBelow = 6;  ///< places
  struct Place {
    Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
    double nearest = 0;                 // m, depth of the nearest look that met it
    std::int64_t first = 0, last = -1;  // ns, looks that met it
    int met = 0, beside = 0;
    int earlier = 0, since = 0;       // looks that went past before the last of these, after it
    std::int64_t passed = -1;         // ns, the last of the latter
    double closest = 0;               // m, depth of the nearest look that met it or went past
    int met_near = 0, past_near = 0;  // looks from near, the latter since it was first met
    // Looks that met this, by how many places further down: that met that one, that went past it.
    std::array<int, kBelow> both{}, over{};
  };
  double finest_;
  std::vector<Place> places_;
};

/// By tiles of the map's x-y, so that a look asks those in its reach alone.
class PlaceColumns {
 public:
  /// Its index. Must hold a place.
  std::size_t add(PlaceColumn column);
  const PlaceColumn& operator[](std::size_t k) const { return columns_[k]; }
  bool empty() const { return columns_.empty(); }
  /// At least those within `reach` (m, in x-y) of a point.
  template <class Visit>
  void for_each_near(const Eigen::Vector3d& at_map, double reach, const Visit& visit) {
    const auto [i0, j0] = tile(at_map - Eigen::Vector3d(reach, reach, 0));
    const auto [i1, j1] = tile(at_map + Eigen::Vector3d(reach, reach, 0));
    for (auto i = i0; i <= i1; ++i) {
      for (auto t = tiles_.lower_bound({i, j0}); t != tiles_.end() && t->first <= Tile{i, j1};
           ++t) {
        for (const std::size_t k : t->second) visit(columns_[k]);
      }
    }
  }

 private:
  using Tile = std::pair<std::int64_t, std::int64_t>;
  static Tile tile(const Eigen::Vector3d& p_map);
  std::vector<PlaceColumn> columns_;
  std::map<Tile, std::vector<std::size_t>> tiles_;
};

}  // namespace lamina
