// A map under way, as the page reads it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include <lamina/models/planar_map.hpp>

namespace lamina::viewer {

/// What a run knows at one moment.
struct LivePicture {
  std::string name;                  ///< of the recording
  std::string doing;                 ///< "reading", "mapping", "refining"
  std::int64_t done = 0, total = 0;  ///< measurements; total 0: not known
  double seconds = 0;                ///< since the run began
  PlanarMap map;
  std::vector<SE3> keyframes;               ///< T_map_body
  std::vector<Eigen::Vector3f> points_map;  ///< where beams ended
  std::string metrics;                      ///< JSON as in metrics.json; empty: none yet
};

/// As map_data(), with {live: {doing, done, total, seconds}} beside it.
std::string live_data(const LivePicture& picture);
/// The data of a map that is finished (map_data()) as the last of a live page.
std::string finished_data(const std::string& map_data, const std::string& folder, double seconds);

}  // namespace lamina::viewer
