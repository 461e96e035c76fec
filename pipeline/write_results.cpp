// What is written and in which order: what matters most first, where there is little time.
#include <lamina/pipeline/write_results.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ostream>
#include <set>

#include <lamina/grid/evidence/scan_fusion.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/graph_files.hpp>
#include <lamina/io/grid_files.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/io/metrics.hpp>
#include <lamina/io/ply_files.hpp>
#include <lamina/io/scan_files.hpp>
#include <lamina/io/terrain_files.hpp>
#include <lamina/pipeline/checkpoint.hpp>
#include <lamina/pipeline/export_map.hpp>

namespace lamina {
namespace {

namespace fs = std::filesystem;

// Where the ground falls away: holes, ledges, stairs going down.
void write_edges(const std::filesystem::path& file, const std::vector<EdgePoint>& edges) {
  io::write_atomically(file, [&](std::ostream& out) {
    out << "x,y,z,sigma\n";
    for (const EdgePoint& edge : edges) {
      if (!edge.negative) continue;
      const Eigen::Vector3d& p = edge.position_map;
      out << fmt::format("{:.4f},{:.4f},{:.4f},{:.4f}\n", p.x(), p.y(), p.z(), edge.sigma);
    }
  });
}

// What an earlier run of another recording or mode left is not this map's: paths, errors, charts,
// what was exported.
void remove_files_of_another_map(const fs::path& folder) {
  std::error_code ignored;
  for (const char* file : {"trajectory_before.txt", "evaluation.json", "window.csv", "path.csv",
                           "path.png", "report.html"}) {
    fs::remove(folder / file, ignored);
  }
  for (const ExportFormat& format : export_formats()) {
    for (const std::string& file : format.files) fs::remove(folder / file, ignored);
  }
  for (int i = 1; fs::remove(folder / fmt::format("trajectory_{}.txt", i), ignored); ++i) {
  }
}

std::string as_yaml(const MapOptions& options, bool comments) {
  return options.to_yaml ? options.to_yaml(options, comments) : std::string();
}

// Writes one result; files are noted as they stand.
class Writer {
 public:
  Writer(const fs::path& folder, const MapResult& result, const RunObserver& observer)
      : folder_(folder), result_(result), observer_(observer) {}

  WrittenResults write();

 private:
  using Clock = std::chrono::steady_clock;
  Diagnostics diagnostics(Clock::time_point began, bool whole) const;
  void write_drawn();
  void write_scans() const;
  void write_grids(const Grids& grids);
  void write_session() const;
  void write_parts();
  void remove_what_was_not_written() const;
  void note(const std::string& file, const std::string& what) {
    summary_ += fmt::format("{:<38} {}\n", (folder_ / file).string(), what);
  }
  void note_all(bool whole);

  fs::path folder_;
  const MapResult& result_;
  const RunObserver& observer_;
  std::set<std::string> written_;
  std::string summary_;
};

// The combined scans in the body frame, with the motion between sensors by the final path.
void Writer::write_scans() const {
  io::write_atomically(folder_ / "scans.csv", [&](std::ostream& out) {
    CombinedScan combined;
    io::write_scan_header(out);
    result_.record->for_each_scan([&](const KeptScan& kept) {
      const SE3 T_map_body = result_.trajectory.at(kept.scan.stamp).value_or(SE3());
      const auto kind = kept.from_depth ? CombinedScan::Kind::kDepth : CombinedScan::Kind::kLidar;
      io::write_scan(out, combined.add(kept.scan, kind, T_map_body));
    });
  });
}

void Writer::write_grids(const Grids& grids) {
  const NavigabilityGrid& grid = grids.navigability;
  const std::optional<OccupancyGrid>& occupancy = grids.occupancy;
  require_time(observer_);
  io::write_grid(folder_ / "grid", grid);
  written_.insert("grid");
  require_time(observer_);
  io::write_navigability_map(folder_, grid);
  written_.insert({"map.yaml", "map.png"});
  require_time(observer_);
  io::write_terrain_ply(folder_ / "terrain.ply", grid);
  written_.insert("terrain.ply");
  const GridGeometry bounds = occupancy ? occupancy->bounds() : GridGeometry{};
  io::write_occupancy_map(folder_, bounds, [&](int row, float* values) {
    require_time(observer_);
    occupancy->image_row(bounds, row, values);
  });
  written_.insert({"occupancy.yaml", "occupancy.pgm"});
}

// What of an earlier run would lie beside a path that is another; never a session that this map was
// made of.
void Writer::remove_what_was_not_written() const {
  std::error_code ignored;
  const auto read = [&](const fs::path& file) {
    return std::any_of(result_.sessions.begin(), result_.sessions.end(),
                       [&](const fs::path& one) { return fs::equivalent(one, file, ignored); });
  };
  for (const char* file : {"scans.csv", "edges.csv", "map.yaml", "map.png", "occupancy.yaml",
                           "occupancy.pgm", "terrain.ply", "grid", "session.lamina"}) {
    if (written_.count(file) == 0 && !read(folder_ / file)) fs::remove_all(folder_ / file, ignored);
  }
}

// Joined maps: the path of each recording by its own clock, too.
void Writer::write_parts() {
  const auto& parts = result_.record->parts;
  if (parts.size() < 2) return;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    Trajectory own;
    for (const StampedPose& p : result_.trajectory) {
      if (p.stamp < parts[i].first || p.stamp > parts[i].last) continue;
      own.add(Timestamp::from_nanoseconds(p.stamp.nanoseconds() - parts[i].shift_ns), p.pose);
    }
    const std::string file = fmt::format("trajectory_{}.txt", i + 1);
    io::write_trajectory(folder_ / file, own);
    note(file, fmt::format("{} poses, as {} counts time", own.size(), parts[i].name));
  }
}

void Writer::write_session() const {
  const RunRecord& record = *result_.record;
  const Trajectory& trajectory = result_.trajectory;
  io::Session session;
  session.settings = as_yaml(result_.options, false);
  session.online = result_.options.online;
  session.parts = record.parts;
  if (record.parts.empty() && !trajectory.empty()) {
    session.parts.push_back(
        {result_.recording, trajectory.front().stamp, trajectory.back().stamp, 0});
  }
  session.map = result_.mapper.state();
  session.before = result_.record->before;
  session.counts = record.diagnostics.counts;
  session.skipped = record.diagnostics.skipped;
  io::write_session(folder_ / "session.lamina", session,
                    {record.scans, record.rims.seen(), record.ground.seen(), record.sights.seen()});
}

void Writer::note_all(bool whole) {
  const Figures& counts = result_.diagnostics().counts;
  const PlanarMap& map = result_.map;
  note("report.html", "the map to look at: open it in a browser");
  note("trajectory.txt", fmt::format("{} poses, {:.1f} m",
                                     result_.trajectory.size() + result_.record->unmapped.size(),
                                     result_.trajectory.length()));
  if (const Figure& after = counts.tracking_lost_after_s; after.known()) {
    note("trajectory.txt", fmt::format("tracking was lost at {:.0f} of {:.0f} steps, first after "
                                       "{:.3f} s: parts of the map may not fit each other",
                                       counts.steps_with_tracking_lost, counts.steps, after));
  }
  note("planes.json", fmt::format("{} planes", map.planes.size()));
  note("surfels.ply", fmt::format("{} surfels", map.surfels.size()));
  note("metrics.json", skipped_text(result_.diagnostics()));
  if (!whole) return;
  note("map.yaml, map.png", "navigability for map_server and nav2");
  note("occupancy.yaml, occupancy.pgm", fmt::format("from {} scans", result_.record->scans.size()));
  note("session.lamina", "the whole map, for `lamina refine`");
}

void Writer::write_drawn() {
  write_scans();
  written_.insert("scans.csv");
  // Where images were looked at for rims: a scanner knows of none.
  if (!result_.map.edges.empty() || result_.record->rims.seen().size() > 0) {
    write_edges(folder_ / "edges.csv", result_.map.edges);
    written_.insert("edges.csv");
  }
  write_grids(*result_.grids);
}

// With what writing itself adds.
Diagnostics Writer::diagnostics(Clock::time_point began, bool whole) const {
  Diagnostics all = result_.diagnostics();
  all.stages["write"].add(std::chrono::duration<double, std::milli>(Clock::now() - began).count());
  if (!whole)
    all.warn("interrupted",
             "interrupted: not all files of the map were written; the same command with --resume "
             "goes on from the checkpoint");
  return all;
}

WrittenResults Writer::write() {
  const auto began = Clock::now();
  const TimeLimit limit(*result_.record, observer_);
  write_path(folder_, result_);
  bool whole = result_.grids.has_value();
  try {
    if (whole) {
      write_drawn();
      write_session();
      written_.insert("session.lamina");
    }
  } catch (const EndedEarly&) {
    whole = false;
  }
  remove_what_was_not_written();
  write_parts();
  note_all(whole);
  io::write_metrics(folder_ / "metrics.json", diagnostics(began, whole));
  return {summary_, whole};
}

}  // namespace

void write_path(const fs::path& folder, const MapResult& result) {
  Trajectory all = result.trajectory;
  for (const auto& [stamp, T_from_to] : result.record->unmapped)
    if (!all.empty()) all.add(stamp, all.back().pose * T_from_to);
  io::write_trajectory(folder / "trajectory.txt", at_recorded_stamps(all, result));
  remove_files_of_another_map(folder);
  if (!result.record->before.empty())
    io::write_trajectory(folder / "trajectory_before.txt",
                         at_recorded_stamps(result.record->before, result));
  io::write_planes_json(folder / "planes.json", result.map.planes);
  io::write_planes_ply(folder / "planes.ply", result.map.planes);
  io::write_surfels_ply(folder / "surfels.ply", result.map.surfels);
  io::write_g2o(folder / "graph.g2o", result.mapper.graph());
  result.record->window.write(folder / "window.csv");
  if (result.options.to_yaml)
    io::write_atomically(folder / "config.yaml", as_yaml(result.options, true));
  if (result.calibration)
    io::write_atomically(folder / "calibration_found.yaml",
                         calibration_found(*result.calibration, result.diagnostics()));
}

WrittenResults write_results(const fs::path& folder, const MapResult& result,
                             const RunObserver& observer) {
  io::make_results_folder(folder);
  const WrittenResults written = Writer(folder, result, observer).write();
  if (written.whole && !result.stopped && !result.options.checkpoint_folder.empty())
    Checkpoint::remove(result.options.checkpoint_folder);
  return written;
}

}  // namespace lamina
