// Gathers what a run produces and writes the output folder.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <lamina/apps/calibration_found.hpp>
#include <lamina/apps/combined_scan.hpp>
#include <lamina/apps/front_end.hpp>
#include <lamina/apps/ground_votes.hpp>
#include <lamina/apps/interrupt.hpp>
#include <lamina/apps/rim_votes.hpp>
#include <lamina/apps/settings.hpp>
#include <lamina/apps/sight_votes.hpp>
#include <lamina/apps/wheel_path.hpp>
#include <lamina/apps/window_log.hpp>
#include <lamina/backend/mapper.hpp>
#include <lamina/grid/navigability_grid.hpp>
#include <lamina/grid/occupancy_grid.hpp>
#include <lamina/io/metrics.hpp>
#include <lamina/io/session.hpp>
#include <lamina/sensors/reclocked_recording.hpp>

namespace lamina {
struct RefineResult;
class Rasterizer;
}  // namespace lamina

namespace lamina::apps {

class GroundHits;
struct ScanOccupancy;

class MapOutput {
 public:
  MapOutput(std::filesystem::path folder, const Settings& settings);

  io::Metrics metrics;
  WindowLog window;
  WheelPath wheel_path;
  MountingsUsed mountings;
  const std::filesystem::path& folder() const { return folder_; }

  /// Keeps the step's scan for scans.csv and the occupancy grid.
  void add(const Step& step, const AddResult& added);
  /// Goes on from a session: its scans, rims, counts and parts; its map is the caller's.
  void take(const io::Session& session);
  void add_skipped(const std::map<std::string, std::int64_t>& skipped);
  std::string skipped_text() const;
  void set_refinement(const RefineResult& result, const Trajectory& before,
                      const Trajectory& after);
  /// The recording's name, for the session.
  void set_recording(const std::string& name) { recording_ = name; }
  /// What corrected the stamps of the map's path: files of poses have the recording's.
  void set_clocks(const ClockOffsets& clocks) { clocks_ = clocks; }
  /// Images show no floor where their mounting says: they make no free ground, here and wherever
  /// the session goes on.
  void draw_no_ground();
  /// While a signal ends the run, write() leaves out what there is no time for.
  void end_with(const InterruptGuard& interrupt);
  /// Steps that no mapper took any more: trajectory.txt goes on with their own motion.
  void go_on(std::span<const Step> steps);
  /// Recorded stamps under which poses at others are written (Recording::restamped).
  void set_restamped(std::map<Timestamp, Timestamp> recorded) { restamped_ = std::move(recorded); }
  /// Writes every file of the contract but those of finish(); each appears whole or not at all.
  /// Returns false where some were left out, and what an earlier run left of them is removed.
  bool write(const Mapper& mapper, bool online);
  /// Writes metrics.json and, from all that is there, report.html.
  void finish();
  /// What was written, one line each, for stdout.
  std::string summary() const { return summary_; }

 private:
  void add_obstacles(const ObstacleScan& obstacles, const SE3& T_body_levelled);
  void keep(const io::KeptScan& scan);
  void for_each_scan(const std::function<void(const io::KeptScan&)>& take) const;
  void note(const std::string& file, const std::string& what);
  void write_path(const Mapper& mapper, const PlanarMap& map, const Trajectory& trajectory);
  void draw(const Mapper& mapper, PlanarMap& map, const Trajectory& trajectory);
  void draw_grids(PlanarMap map, const Trajectory& trajectory);
  void write_grids(const NavigabilityGrid& grid, const std::optional<OccupancyGrid>& occupancy);
  bool draws_ground() const;
  void end_if_time_is_up() const;
  ScanOccupancy occupancy_of(const Trajectory& trajectory, const GroundHits& ground) const;
  void settle_points(PlanarMap& map, const Trajectory& trajectory, const GroundHits& ground,
                     const ScanOccupancy& seen) const;
  NavigabilityGrid ground_of(Rasterizer&& rasterizer, const Trajectory& trajectory) const;
  void remove_what_was_not_drawn() const;
  void note_all(const PlanarMap& map, const Trajectory& trajectory, bool whole);
  void write_parts(const Trajectory& trajectory);
  void remove_what_is_of_another_map() const;
  void write_session(const Mapper& mapper, const Trajectory& trajectory, bool online);

  std::filesystem::path folder_;
  Settings settings_;
  std::string recording_;
  ClockOffsets clocks_;
  const InterruptGuard* interrupt_ = nullptr;
  std::vector<std::pair<Timestamp, SE3>> unmapped_;  // and the motion that led there
  std::map<Timestamp, Timestamp> restamped_;
  std::vector<io::SessionPart> parts_;  // of a session that goes on
  std::set<std::string> drawn_;         // files that stand though what comes after them does not
  io::Spool scans_;                     // io::KeptScan, for scans.csv and the occupancy grid
  RimVotes rims_;
  GroundVotes ground_;
  SightVotes sights_;
  void write_scans(const Trajectory& trajectory) const;
  Trajectory at_recorded_stamps(const Trajectory& trajectory) const;
  Trajectory at_uncorrected_stamps(const Trajectory& trajectory) const;
  Trajectory before_;
  void note_open_way(const Step& step);
  void note_tracking(Timestamp stamp, bool lost);
  std::optional<Timestamp> tracked_;         // the last step whose motion was known
  bool lost_ = false;                        // at the last step
  double open_way_ = 0, open_scan_way_ = 0;  // m up to the last step that images, scans left open
  std::string summary_;
};

}  // namespace lamina::apps
