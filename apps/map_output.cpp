// The output folder.
#include <lamina/apps/map_output.hpp>

#include <fmt/format.h>

#include <cmath>

#include <lamina/backend/refiner.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/graph_files.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/io/ply_files.hpp>
#include <lamina/io/scan_files.hpp>

namespace lamina::apps {

MapOutput::MapOutput(std::filesystem::path folder, const Settings& settings)
    : folder_(std::move(folder)), settings_(settings) {}

void MapOutput::add(const Step& step, const AddResult& added) {
  ++metrics.counts["steps"];
  if (added.is_keyframe) ++metrics.counts["keyframes"];
  if (!step.motion_known) ++metrics.counts["steps_with_unknown_motion"];
  if (added.loop_closed) ++metrics.counts["loops"];
  if (step.scan) scans_.push_back(*step.scan);
}

void MapOutput::add_skipped(const std::map<std::string, std::int64_t>& skipped) {
  for (const auto& [why, count] : skipped) metrics.skipped[why] += count;
}

std::string MapOutput::skipped_text() const {
  if (metrics.skipped.empty()) return "nothing was skipped";
  std::string text = "skipped:";
  for (const auto& [why, count] : metrics.skipped) text += fmt::format(" {} {};", count, why);
  text.pop_back();
  return text;
}

void MapOutput::set_refinement(const RefineResult& result, const Trajectory& before,
                               const Trajectory& after) {
  io::RefineMetrics refine;
  refine.solve_s = result.solve_s;
  refine.iterations = result.iterations;
  refine.status = to_string(result.status);
  double squares = 0;
  for (std::size_t i = 0; i < before.size() && i < after.size(); ++i) {
    squares += (before[i].pose.translation() - after[i].pose.translation()).squaredNorm();
  }
  if (!before.empty()) {
    refine.moved_rms_m = std::sqrt(squares / static_cast<double>(before.size()));
  }
  metrics.refine = refine;
}

void MapOutput::note(const std::string& file, const std::string& what) {
  summary_ += fmt::format("{:<38} {}\n", (folder_ / file).string(), what);
}

void MapOutput::write(const Mapper& mapper, bool online) {
  const PlanarMap map = mapper.map();
  const Trajectory trajectory = online ? mapper.online_trajectory() : mapper.trajectory();
  {
    const auto timer = metrics.time("write");
    io::write_trajectory(folder_ / "trajectory.txt", trajectory);
    io::write_planes_json(folder_ / "planes.json", map.planes);
    io::write_planes_ply(folder_ / "planes.ply", map.planes);
    io::write_surfels_ply(folder_ / "surfels.ply", map.surfels);
    io::write_g2o(folder_ / "graph.g2o", mapper.graph());
    io::write_atomically(folder_ / "scans.csv", [this](std::ostream& out) {
      io::write_scan_header(out);
      for (const LaserScan& scan : scans_) io::write_scan(out, scan);
    });
    io::write_atomically(folder_ / "config.yaml", to_yaml(settings_, true));
  }
  metrics.counts["planes"] = static_cast<double>(map.planes.size());
  metrics.counts["path_m"] = trajectory.length();
  io::write_metrics(folder_ / "metrics.json", metrics);
  note("trajectory.txt", fmt::format("{} poses, {:.1f} m", trajectory.size(), trajectory.length()));
  note("planes.json", fmt::format("{} planes", map.planes.size()));
  note("surfels.ply", fmt::format("{} surfels", map.surfels.size()));
  note("metrics.json", skipped_text());
}

}  // namespace lamina::apps
