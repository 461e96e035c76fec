// Votes for and against each rim, by the refined path.
#include <lamina/grid/evidence/negative_obstacles.hpp>

#include <algorithm>
#include <cmath>
#include <map>

#include <lamina/grid/evidence/looks_archive.hpp>
#include <lamina/grid/grid_geometry.hpp>
#include <lamina/models/model_archive.hpp>

namespace lamina {
namespace {

constexpr int kPassesNeeded = 3;
constexpr int kBeamsAround = 2;
constexpr double kFarthest = 6;  // m: no floor is followed further
constexpr double kVague = 0.05;  // m: two sigma are what the grid says where an edge lies to

struct Place {
  EdgePoint rim;
  double nearest_rim = 1e9, nearest_pass = 1e9;  // m from the robot
  std::size_t last_rim = 0;                      // index of the view
  int passes = 0, passes_since = 0;              // all; after the last view that saw the rim

  bool taken_back() const {
    return (passes >= kPassesNeeded && nearest_pass < nearest_rim) || passes_since >= kPassesNeeded;
  }
};

struct View : SeenRims {
  int beam_of(double angle) const;
  /// Was floor seen beyond a place (levelled frame), by the beams around it too?
  bool passed(const Eigen::Vector2d& place, double margin) const;
};

View view_of(std::string_view bytes) {
  View view;
  ArchiveReader archive(bytes);
  archive(static_cast<SeenRims&>(view));
  return view;
}

std::string bytes_of(const SeenRims& view) {
  ArchiveWriter archive;
  archive(view);
  return archive.bytes();
}

int View::beam_of(double angle) const {
  const double offset = std::remainder(angle - angle_min, 2 * M_PI);
  const double k = std::floor(
      (offset < -0.5 * angle_increment ? offset + 2 * M_PI : offset) / angle_increment + 0.5);
  return k >= 0 && k < static_cast<double>(reach.size()) ? static_cast<int>(k) : -1;
}

bool View::passed(const Eigen::Vector2d& place, double margin) const {
  const double range = place.norm() + margin;
  const int beam = beam_of(std::atan2(place.y(), place.x()));
  if (beam < kBeamsAround || beam + kBeamsAround >= static_cast<int>(reach.size())) return false;
  for (int k = beam - kBeamsAround; k <= beam + kBeamsAround; ++k) {
    if (!(static_cast<double>(reach[static_cast<std::size_t>(k)]) > range)) return false;
  }
  return true;
}

}  // namespace

void RimVotes::take(const std::vector<SeenRims>& seen) {
  views_.clear();
  for (const SeenRims& view : seen) views_.add(bytes_of(view));
}

void RimVotes::add(const ObstacleScan& scan, const SE3& T_body_levelled) {
  SeenRims view{scan.stamp,           T_body_levelled,  scan.angle_min,
                scan.angle_increment, scan.floor_range, {}};
  for (const EdgePoint& edge : edge_points(scan)) {
    if (edge.negative) view.rims_levelled.push_back(edge);
  }
  const auto knows = [](float reach) { return reach > 0; };
  if (view.rims_levelled.empty() && std::none_of(view.reach.begin(), view.reach.end(), knows))
    return;
  views_.add(bytes_of(view));
}

std::vector<EdgePoint> RimVotes::rims(const Trajectory& trajectory, double resolution) const {
  std::map<CellIndex, Place> places;
  std::vector<SE3> T_levelled_map(views_.size());
  std::vector<char> placed(views_.size(), 0);
  std::size_t v = 0;
  views_.for_each([&](std::string_view bytes) {
    const View view = view_of(bytes);
    const std::size_t index = v++;
    const auto T_map_body = trajectory.at(view.stamp);
    if (!T_map_body) return;
    const SE3 T_map_levelled = *T_map_body * view.T_body_levelled;
    T_levelled_map[index] = T_map_levelled.inverse();
    placed[index] = 1;
    for (const EdgePoint& edge : view.rims_levelled) {
      const Eigen::Vector3d p = T_map_levelled * edge.position_map;
      auto [at, fresh] = places.try_emplace(cell_of(p.head<2>(), resolution));
      Place& place = at->second;
      if (fresh || edge.sigma < place.rim.sigma) place.rim = {p, edge.sigma, true};
      place.nearest_rim = std::min(place.nearest_rim, edge.position_map.head<2>().norm());
      place.last_rim = index;
    }
  });
  v = 0;
  views_.for_each([&](std::string_view bytes) {
    const std::size_t index = v++;
    if (!placed[index]) return;
    const View view = view_of(bytes);
    for (auto& [cell, place] : places) {
      const Eigen::Vector3d p = T_levelled_map[index] * place.rim.position_map;
      const double range = p.head<2>().norm();
      if (range > kFarthest || std::abs(p.z()) > 0.1 + 0.1 * range) continue;
      const double sigma = std::min(place.rim.sigma, kVague);
      if (!view.passed(p.head<2>(), 2 * resolution + sigma)) continue;
      ++place.passes;
      place.passes_since += index > place.last_rim;
      place.nearest_pass = std::min(place.nearest_pass, range);
    }
  });
  std::vector<EdgePoint> out;
  for (const auto& [cell, place] : places) {
    if (place.taken_back()) continue;
    out.push_back(place.rim);
    if (place.rim.sigma <= kVague) continue;
    out.back().sigma = kVague;
    out.back().negative = false;
  }
  return out;
}

}  // namespace lamina
