// What the steps of a run leave behind beside the map: scans, looks, path, figures.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/frontend/frontend.hpp>
#include <lamina/grid/evidence/dynamic_removal.hpp>
#include <lamina/grid/evidence/ground_evidence.hpp>
#include <lamina/grid/evidence/negative_obstacles.hpp>
#include <lamina/io/session.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/models/spool.hpp>
#include <lamina/pipeline/calibration/calibration_found.hpp>
#include <lamina/pipeline/calibration/path_uncertainty.hpp>
#include <lamina/pipeline/calibration/sensor_changes.hpp>
#include <lamina/pipeline/window_log.hpp>

namespace lamina {

struct RefineResult;

class RunRecord {
 public:
  /// Lists that grow with the recording are kept in files without a name in `folder`.
  explicit RunRecord(const std::filesystem::path& folder);

  Diagnostics diagnostics;
  WindowLog window;
  WheelPath wheel_path;
  SensorChanges changes;
  MountingsUsed mountings;
  Spool scans;  ///< KeptScan
  RimVotes rims;
  GroundVotes ground;
  SightVotes sights;
  std::vector<io::SessionPart> parts;  ///< of a session that goes on
  Trajectory before;                   ///< T_map_body before the refinement; may be empty
  /// Steps that no mapper took any more, and the motion that led to each.
  std::vector<std::pair<Timestamp, SE3>> unmapped;

  /// A step and what the mapper made of it.
  void add(const Step& step, const AddResult& added);
  /// Goes on from a session: its scans, looks, counts and parts; its map is the caller's.
  void take(const io::Session& session);
  void add_skipped(const SkippedCounts& skipped);
  void set_refinement(const RefineResult& result, const Trajectory& before_it,
                      const Trajectory& after);
  /// Steps that no mapper took any more.
  void go_on(std::span<const Step> steps);
  void for_each_scan(const std::function<void(const KeptScan&)>& take) const;
  /// Called before each item of every list; what it throws ends that.
  void before_each_item(const std::function<void()>& call);

 private:
  void add_obstacles(const ObstacleScan& obstacles, const SE3& T_body_levelled);
  void keep(const KeptScan& scan);
  void note_open_way(const Step& step);
  void note_tracking(Timestamp stamp, bool lost);

  std::optional<Timestamp> tracked_;         // the last step whose motion was known
  bool lost_ = false;                        // at the last step
  double open_way_ = 0, open_scan_way_ = 0;  // m up to the last step that images, scans left open
};

/// "skipped: 3 reason; 2 another", or "nothing was skipped".
std::string skipped_text(const Diagnostics& diagnostics);

}  // namespace lamina
