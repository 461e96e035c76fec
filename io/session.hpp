// session.lamina: a whole map with all that is needed to refine it, draw it or join it to others.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lamina/backend/mapper/map_state.hpp>
#include <lamina/grid/evidence/looks.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/models/spool.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina::io {

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
  Trajectory before;  ///< T_map_body before the refinement; may be empty
  Figures counts;     ///< as in metrics.json
  SkippedCounts skipped;

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
