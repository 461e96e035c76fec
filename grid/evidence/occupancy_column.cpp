// Counting, and what the counts say.
#include <lamina/grid/evidence/occupancy_column.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr int kPasses = 3;        // looks that went past
constexpr double kAsNear = 1.5;   // times the depth of the nearest that met it: they see as well
constexpr double kPassing = 1e9;  // ns

}  // namespace

void PlaceColumn::meet(Timestamp stamp, std::span<const PlaceSight> sights) {
  const std::int64_t ns = stamp.nanoseconds();
  for (std::size_t k = 0; k < places_.size(); ++k) {
    Place& place = places_[k];
    if (sights[k].sight == Sight::kUnknown) continue;
    const double depth = sights[k].depth;
    place.closest = place.closest > 0 ? std::min(place.closest, depth) : depth;
    if (sights[k].sight != Sight::kMet) continue;
    const bool first = place.met++ == 0;
    place.first = first ? ns : std::min(place.first, ns);
    place.last = first ? ns : std::max(place.last, ns);
    place.nearest = first ? sights[k].depth : std::min(place.nearest, sights[k].depth);
    for (std::size_t d = 0; d < std::min<std::size_t>(k, kBelow); ++d) {
      const PlaceSight& below = sights[k - 1 - d];
      const double apart = (place.p_map - places_[k - 1 - d].p_map).norm();
      place.both[d] += below.sight == Sight::kMet && apart > sights[k].blur + below.blur;
      place.over[d] += below.sight == Sight::kPast;
    }
  }
}

void PlaceColumn::pass(Timestamp stamp, std::span<const PlaceSight> sights, double pixel) {
  const std::int64_t ns = stamp.nanoseconds();
  for (std::size_t k = 0; k < places_.size(); ++k) {
    Place& place = places_[k];
    const bool near = sights[k].depth <= kAsNear * place.closest;
    if (sights[k].sight == Sight::kMet) place.met_near += near;
    if (sights[k].sight != Sight::kPast) continue;
    place.past_near += near && place.met > 0 && ns > place.first;
    if (sights[k].depth > std::max(kAsNear * place.nearest, finest_ / pixel)) continue;
    if (place.met > 0 && ns < place.last) {
      ++place.earlier;
    } else {
      ++place.since;
      place.passed = std::max(place.passed, ns);
    }
  }
}

bool PlaceColumn::free_again(std::size_t k) const {
  const Place& place = places_[k];
  if (place.since >= kPasses) return true;
  for (std::size_t d = 0; d < std::min<std::size_t>(k, kBelow); ++d) {
    const Place& below = places_[k - 1 - d];
    const bool gone = below.since >= kPasses && below.passed > place.last;
    if (gone && place.both[d] > 0 && place.over[d] == 0) return true;
  }
  return false;
}

bool PlaceColumn::met_in_passing(std::size_t k) const {
  const Place& place = places_[k];
  return place.met > 0 && static_cast<double>(place.last - place.first) < kPassing &&
         place.earlier >= kPasses * place.met && !free_again(k);
}

bool PlaceColumn::moved_along(std::size_t k) const {
  const Place& place = places_[k];
  return place.met > 0 && place.beside == place.met && !free_again(k);
}

bool PlaceColumn::outvoted(std::size_t k) const {
  const Place& place = places_[k];
  return place.past_near >= kPasses && place.past_near > place.met_near;
}

bool PlaceColumn::no_wall(std::size_t k) const {
  const Place& place = places_[k];
  return free_again(k) || (place.met > 0 && place.earlier >= std::max(kPasses, place.met));
}

std::size_t PlaceColumns::add(PlaceColumn column) {
  tiles_[tile(column.at_map(0))].push_back(columns_.size());
  columns_.push_back(std::move(column));
  return columns_.size() - 1;
}

PlaceColumns::Tile PlaceColumns::tile(const Eigen::Vector3d& p_map) {
  return {to_far_cell(p_map.x()), to_far_cell(p_map.y())};
}

}  // namespace lamina
