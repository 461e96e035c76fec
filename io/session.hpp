// session.lamina: a whole map with all that is needed to refine it, draw it or join it to others.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lamina/backend/map_state.hpp>
#include <lamina/io/spool.hpp>
#include <lamina/models/depth_look.hpp>
#include <lamina/models/ground_look.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina::io {

/// Rims of holes seen at one instant, and how far floor was seen past them.
struct SeenRims {
  Timestamp stamp;
  SE3 T_body_levelled;
  double angle_min = 0, angle_increment = 0;
  std::vector<float> reach;  ///< m from the origin, ground seen without a break
  std::vector<EdgePoint> rims_levelled;
};

/// What an image saw of the ground, and where that frame lies in the body.
struct SeenGround {
  Timestamp stamp;
  SE3 T_body_levelled;
  GroundLook look;
};

/// What an image saw through, and where its camera is in the body.
struct SeenDepth {
  Timestamp stamp;
  SE3 T_body_camera;
  DepthLook look;
};

/// A scan in its own frame (`scan.lidar.T_body_lidar`), real or made from depth.
struct KeptScan {
  LaserScan scan;
  bool from_depth = false;
};

/// One recording of a map: which stamps are its own. Joined maps have several.
struct SessionPart {
  std::string name;           ///< of the recording
  Timestamp first, last;      ///< in this map
  std::int64_t shift_ns = 0;  ///< these stamps - those of the recording
};

struct Session {
  std::string settings;  ///< config.yaml
  bool online = false;   ///< the path is what was known at each instant
  std::vector<SessionPart> parts;
  MapState map;
  std::vector<KeptScan> scans;
  std::vector<SeenRims> rims;
  std::vector<SeenGround> ground;
  std::vector<SeenDepth> sights;
  Trajectory before;                     ///< T_map_body before the refinement; may be empty
  std::map<std::string, double> counts;  ///< as in metrics.json
  std::map<std::string, std::int64_t> skipped;

  /// Moves all stamps.
  void shift_time(std::int64_t nanoseconds);
};

/// Whole or not at all.
void write_session(const std::filesystem::path& file, const Session& session);
/// The archived items (session_archive.hpp) of the lists of a session.
struct SessionLists {
  const Spool &scans, &rims, &ground, &sights;
};
/// The same with these lists, of which `session` itself holds none: never all of them in memory.
void write_session(const std::filesystem::path& file, const Session& session,
                   const SessionLists& lists);
/// Throws lamina::Error, one line: not there, something else, another version, cut short, damaged.
Session read_session(const std::filesystem::path& file);
/// What stands behind the header; `name` is the file's, for the error line.
Session parse_session(std::string_view content, const std::string& name);
std::string session_content(const Session& session);

}  // namespace lamina::io
