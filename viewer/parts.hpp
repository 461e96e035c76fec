// The pieces of the page's data as JSON text, from values in memory: a folder's files and a run
// under way give them alike.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <unordered_set>
#include <vector>

#include <lamina/models/planar_map.hpp>

namespace lamina::viewer {

inline constexpr std::size_t kMostPoses = 20000, kMostSurfels = 150000, kMostCells = 2000000,
                             kMostKeyframes = 5000, kMostPoints = 150000, kMostEdges = 20000,
                             kMostWindows = 2000;

/// Bytes of base64 that a grid's four layers, and the occupancy, may take: rows and columns are
/// thinned until they do. With the bounds above a report stays below 15 MB whatever the map.
inline constexpr std::size_t kMostGridText = 5500000, kMostOccupancyText = 1500000;

/// The text of a JSON object, member by member; members are JSON texts themselves.
class ObjectText {
 public:
  void add(const std::string& key, const std::string& json) {
    text_ += (text_.empty() ? "\"" : ",\n\"") + key + "\":" + json;
  }
  std::string text() const { return "{" + text_ + "}"; }

 private:
  std::string text_;
};

/// A JSON string, ASCII only.
std::string quoted(const std::string& text);

/// [{id, label, rho, theta, phi, sigma_rho, sigma_angle, area, normal, observations, unobserved,
/// outlines: [[[x, y, z], ...], ...]}], map frame, m and rad; outlines to 0.1 mm.
std::string planes_text(const std::vector<MapPlane>& planes);

/// {total, count, length, times, positions}: thinned to kMostPoses, the last one kept; seconds from
/// `start` on, so that 32 bits hold them to a tenth of a millisecond.
std::string track_text(const Trajectory& trajectory, double start);

/// {total, count, poses: x y z heading of each} of T_map_body, thinned to kMostKeyframes.
std::string keyframes_text(const std::vector<SE3>& T_map_body);

/// {count, total, position, normal, radius}: those of every thinning_stride(total, kMostSurfels).
std::string surfels_text(const std::vector<Surfel>& thinned, std::size_t total);

/// {count, total, origin, step, codes}: point k is origin + step * (three unsigned 16-bit numbers).
/// Thinned to `most`.
std::string points_text(const std::vector<Eigen::Vector3f>& points_map, std::size_t most);

/// Points, at most one for each cube of kCell m: what many scans saw counts once.
class PointCloud {
 public:
  static constexpr float kCell = 0.02F;
  void add(const Eigen::Vector3f& point_map);
  const std::vector<Eigen::Vector3f>& points() const { return points_; }

 private:
  std::unordered_set<std::uint64_t> cells_;
  std::vector<Eigen::Vector3f> points_;
};

}  // namespace lamina::viewer
