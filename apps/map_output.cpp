// The output folder.
#include <lamina/apps/map_output.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <ostream>
#include <set>

#include <lamina/apps/recorded_stamps.hpp>
#include <lamina/backend/refiner.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/decimal_seconds.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/io/scan_files.hpp>
#include <lamina/io/session_archive.hpp>

namespace lamina::apps {

MapOutput::MapOutput(std::filesystem::path folder, const Settings& settings)
    : folder_(std::move(folder)),
      settings_(settings),
      scans_(folder_),
      rims_(folder_),
      ground_(folder_),
      sights_(folder_) {}

void MapOutput::keep(const io::KeptScan& scan) {
  ArchiveWriter archive;
  archive(scan);
  scans_.add(archive.bytes());
}

void MapOutput::for_each_scan(const std::function<void(const io::KeptScan&)>& take) const {
  scans_.for_each([&take](std::string_view bytes) {
    io::KeptScan scan;
    ArchiveReader archive(bytes);
    archive(scan);
    take(scan);
  });
}

void MapOutput::add(const Step& step, const AddResult& added) {
  ++metrics.counts["steps"];
  if (added.is_keyframe) ++metrics.counts["keyframes"];
  if (!step.motion_known) ++metrics.counts["steps_with_unknown_motion"];
  note_open_way(step);
  wheel_path.add(step);
  mountings.add(step);
  note_tracking(step.observations.stamp, step.tracking_lost);
  if (added.loop_closed) ++metrics.counts["loops"];
  if (step.scan) keep({*step.scan, false});
  if (step.obstacles) add_obstacles(*step.obstacles, step.T_body_levelled);
  if (step.ground) ground_.add(step.observations.stamp, *step.ground, step.T_body_levelled);
  if (step.sight)
    sights_.add(step.observations.stamp, *step.sight, step.observations.T_body_sensor);
}

// How far images in a row, or scans, left a direction of their motion open.
void MapOutput::note_open_way(const Step& step) {
  const bool scan = step.scan.has_value();
  if (step.open_direction) {
    ++metrics.counts[scan ? "scans_with_open_direction" : "steps_with_open_direction"];
  }
  double& way = scan ? open_scan_way_ : open_way_;
  way = step.open_direction ? way + step.motion.T_from_to.translation().norm() : 0;
  if (way == 0) return;
  double& longest =
      metrics.counts[scan ? "scans_open_direction_longest_m" : "open_direction_longest_m"];
  longest = std::max(longest, way);
}

void MapOutput::note_tracking(Timestamp stamp, bool lost) {
  std::vector<io::LostSpan>& spans = metrics.tracking_lost;
  if (lost) {
    const double after = io::decimal_seconds(tracked_.value_or(stamp));
    ++metrics.counts["steps_with_tracking_lost"];
    metrics.counts.try_emplace("tracking_lost_after_s", after);
    if (!lost_) {
      constexpr std::size_t kMostLines = 5;  // metrics.json has them all
      if (spans.size() < kMostLines) {
        spdlog::warn("tracking lost after {:.3f} s: the motion up to {:.3f} s is a guess", after,
                     stamp.seconds());
      }
      if (spans.size() < io::Metrics::kMostSpans) spans.push_back({after, std::nullopt});
    }
  } else {
    if (lost_ && !spans.empty() && !spans.back().until_s) {
      spans.back().until_s = io::decimal_seconds(stamp);
    }
    tracked_ = stamp;
  }
  lost_ = lost;
}

void MapOutput::take(const io::Session& session) {
  parts_ = session.parts;
  for (const io::KeptScan& scan : session.scans) keep(scan);
  rims_.take(session.rims);
  ground_.take(session.ground);
  sights_.take(session.sights);
  metrics.counts = session.counts;
  metrics.skipped = session.skipped;
}

void MapOutput::add_obstacles(const ObstacleScan& obstacles, const SE3& T_body_levelled) {
  io::KeptScan scan{obstacles.to_laser_scan(), true};
  scan.scan.lidar.T_body_lidar = T_body_levelled;
  keep(scan);
  rims_.add(obstacles, T_body_levelled);
}

// The combined scans in the body frame, with the motion between sensors by the final path.
void MapOutput::write_scans(const Trajectory& trajectory) const {
  io::write_atomically(folder_ / "scans.csv", [&](std::ostream& out) {
    CombinedScan combined;
    io::write_scan_header(out);
    for_each_scan([&](const io::KeptScan& kept) {
      const SE3 T_map_body = trajectory.at(kept.scan.stamp).value_or(SE3());
      const auto kind = kept.from_depth ? CombinedScan::Kind::kDepth : CombinedScan::Kind::kLidar;
      io::write_scan(out, combined.add(kept.scan, kind, T_map_body));
    });
  });
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
  for (const CostChange& cost : result.costs) {
    refine.cost_before[to_string(cost.type)] = cost.before;
    refine.cost_after[to_string(cost.type)] = cost.after;
  }
  metrics.counts["rejected_factors"] = static_cast<double>(result.rejected.size());
  before_ = before;
  metrics.refine = refine;
}

void MapOutput::note(const std::string& file, const std::string& what) {
  summary_ += fmt::format("{:<38} {}\n", (folder_ / file).string(), what);
}

// Joined maps: the path of each recording by its own clock, too.
void MapOutput::write_parts(const Trajectory& trajectory) {
  if (parts_.size() < 2) return;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Trajectory own;
    for (const StampedPose& p : trajectory) {
      if (p.stamp < parts_[i].first || p.stamp > parts_[i].last) continue;
      own.add(Timestamp::from_nanoseconds(p.stamp.nanoseconds() - parts_[i].shift_ns), p.pose);
    }
    const std::string file = fmt::format("trajectory_{}.txt", i + 1);
    io::write_trajectory(folder_ / file, own);
    note(file, fmt::format("{} poses, as {} counts time", own.size(), parts_[i].name));
  }
}

// What an earlier run of another recording or mode left is not this map's: paths, errors, charts.
void MapOutput::remove_what_is_of_another_map() const {
  std::error_code ignored;
  for (const char* file :
       {"trajectory_before.txt", "evaluation.json", "window.csv", "path.csv", "path.png"}) {
    std::filesystem::remove(folder_ / file, ignored);
  }
  for (int i = 1; std::filesystem::remove(folder_ / fmt::format("trajectory_{}.txt", i), ignored);
       ++i) {
  }
}

void MapOutput::write_session(const Mapper& mapper, const Trajectory& trajectory, bool online) {
  io::Session session;
  session.settings = to_yaml(settings_, false);
  session.online = online;
  session.parts = parts_;
  if (parts_.empty() && !trajectory.empty()) {
    session.parts.push_back({recording_, trajectory.front().stamp, trajectory.back().stamp, 0});
  }
  session.map = mapper.state();
  session.before = before_;
  session.counts = metrics.counts;
  session.skipped = metrics.skipped;
  io::write_session(folder_ / "session.lamina", session,
                    {scans_, rims_.seen(), ground_.seen(), sights_.seen()});
}

Trajectory MapOutput::at_recorded_stamps(const Trajectory& trajectory) const {
  if (restamped_.empty()) return at_uncorrected_stamps(trajectory);
  Trajectory result;
  for (const auto& [stamp, pose] : at_uncorrected_stamps(trajectory)) {
    const auto recorded = restamped_.find(stamp);
    result.add(recorded == restamped_.end() ? stamp : recorded->second, pose);
  }
  return result;
}

Trajectory MapOutput::at_uncorrected_stamps(const Trajectory& trajectory) const {
  if (!clocks_.any()) return trajectory;
  std::set<Timestamp> scans;
  for_each_scan([&scans](const io::KeptScan& kept) {
    if (!kept.from_depth) scans.insert(kept.scan.stamp);
  });
  return apps::at_recorded_stamps(trajectory, clocks_, scans);
}

}  // namespace lamina::apps
