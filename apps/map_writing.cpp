// What a run writes and in which order: what matters most first where a signal leaves little time.
#include <fmt/format.h>

#include <ostream>

#include <lamina/apps/map_output.hpp>
#include <lamina/backend/refiner.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/graph_files.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/io/ply_files.hpp>
#include <lamina/viewer/report.hpp>

namespace lamina::apps {
namespace {

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

}  // namespace

void MapOutput::end_with(const InterruptGuard& interrupt) {
  interrupt_ = &interrupt;
  for (io::Spool* spool : {&scans_, &rims_.seen(), &ground_.seen(), &sights_.seen()}) {
    spool->before_each([this] { end_if_time_is_up(); });
  }
}

void MapOutput::go_on(std::span<const Step> steps) {
  for (const Step& step : steps)
    unmapped_.emplace_back(step.observations.stamp, step.motion.T_from_to);
}

void MapOutput::write_path(const Mapper& mapper, const PlanarMap& map,
                           const Trajectory& trajectory) {
  const auto timer = metrics.time("write");
  Trajectory all = trajectory;
  for (const auto& [stamp, T_from_to] : unmapped_)
    if (!all.empty()) all.add(stamp, all.back().pose * T_from_to);
  io::write_trajectory(folder_ / "trajectory.txt", at_recorded_stamps(all));
  remove_what_is_of_another_map();
  if (!before_.empty())
    io::write_trajectory(folder_ / "trajectory_before.txt", at_recorded_stamps(before_));
  io::write_planes_json(folder_ / "planes.json", map.planes);
  io::write_planes_ply(folder_ / "planes.ply", map.planes);
  io::write_surfels_ply(folder_ / "surfels.ply", map.surfels);
  io::write_g2o(folder_ / "graph.g2o", mapper.graph());
  window.write(folder_ / "window.csv");
  io::write_atomically(folder_ / "config.yaml", to_yaml(settings_, true));
}

void MapOutput::draw(const Mapper& mapper, PlanarMap& map, const Trajectory& trajectory) {
  const std::vector<EdgePoint> rims = rims_.rims(trajectory, settings_.grid_resolution);
  map.edges.insert(map.edges.end(), rims.begin(), rims.end());
  {
    const auto timer = metrics.time("sights");
    sights_.withdraw(
        map, trajectory, settings_.grid_resolution,
        [this](const auto& take) { for_each_scan(take); }, settings_.threads);
  }
  write_path(mapper, map, trajectory);
  {
    const auto timer = metrics.time("write");
    write_scans(trajectory);
    drawn_.insert("scans.csv");
    if (!map.edges.empty() || metrics.stages.count("obstacles") > 0)
      write_edges(folder_ / "edges.csv", map.edges);
    drawn_.insert("edges.csv");
  }
  draw_grids(map, trajectory);
}

// What of an earlier run would lie beside a path that is another.
void MapOutput::remove_what_was_not_drawn() const {
  std::error_code ignored;
  for (const char* file :
       {"scans.csv", "edges.csv", "map.yaml", "map.png", "occupancy.yaml", "occupancy.pgm",
        "terrain.ply", "grid", "report.html", "session.lamina"}) {
    if (drawn_.count(file) == 0) std::filesystem::remove_all(folder_ / file, ignored);
  }
}

bool MapOutput::write(const Mapper& mapper, bool online) {
  PlanarMap map = mapper.map();
  const Trajectory trajectory = online ? mapper.online_trajectory() : mapper.trajectory();
  bool whole = true;
  try {
    // What matters most comes first where there may be no time for more.
    if (interrupt_ && interrupt_->ending()) write_path(mapper, map, trajectory);
    draw(mapper, map, trajectory);
  } catch (const EndedEarly&) {
    whole = false;
    write_path(mapper, map, trajectory);
    remove_what_was_not_drawn();
  }
  metrics.counts["planes"] = static_cast<double>(map.planes.size());
  metrics.counts["path_m"] = trajectory.length();
  if (whole) {
    const auto timer = metrics.time("write");
    try {
      write_session(mapper, trajectory, online);
    } catch (const EndedEarly&) {
      whole = false;
    }
  }
  write_parts(trajectory);
  note_all(map, trajectory, whole);
  return whole;
}

void MapOutput::note_all(const PlanarMap& map, const Trajectory& trajectory, bool whole) {
  note("report.html", "the map to look at: open it in a browser");
  note("trajectory.txt", fmt::format("{} poses, {:.1f} m", trajectory.size() + unmapped_.size(),
                                     trajectory.length()));
  if (const auto lost = metrics.counts.find("tracking_lost_after_s");
      lost != metrics.counts.end()) {
    note("trajectory.txt", fmt::format("tracking was lost at {:.0f} of {:.0f} steps, first after "
                                       "{:.3f} s: parts of the map may not fit each other",
                                       metrics.counts["steps_with_tracking_lost"],
                                       metrics.counts["steps"], lost->second));
  }
  note("planes.json", fmt::format("{} planes", map.planes.size()));
  note("surfels.ply", fmt::format("{} surfels", map.surfels.size()));
  note("metrics.json", skipped_text());
  if (!whole) return;
  note("map.yaml, map.png", "navigability for map_server and nav2");
  note("occupancy.yaml, occupancy.pgm", fmt::format("from {} scans", scans_.size()));
  note("session.lamina", "the whole map, for `lamina refine`");
}

void MapOutput::finish() {
  io::write_metrics(folder_ / "metrics.json", metrics);
  viewer::write_report(folder_);
}

}  // namespace lamina::apps
