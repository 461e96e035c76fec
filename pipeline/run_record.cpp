// Steps into lists and figures.
#include <lamina/models/skipped.hpp>
#include <lamina/pipeline/run_record.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include <lamina/backend/refine/refiner.hpp>
#include <lamina/grid/evidence/looks_archive.hpp>
#include <lamina/io/decimal_seconds.hpp>
#include <lamina/pipeline/calibration/log.hpp>

namespace lamina {

RunRecord::RunRecord(const std::filesystem::path& folder)
    : scans(folder), rims(folder), ground(folder), sights(folder) {
  // What every run is asked about is written, 0 where it never happened.
  Figures& counts = diagnostics.counts;
  for (Figure* figure : {&counts.steps_with_unknown_motion, &counts.steps_with_open_direction,
                         &counts.open_direction_longest_m, &counts.scans_open_direction_longest_m,
                         &counts.scans_left_out, &counts.by_wheels_alone_m,
                         &counts.by_wheels_alone_sigma_m, &counts.way_by_wheels_alone_longest_m})
    *figure = 0;
}

void RunRecord::keep(const KeptScan& scan) {
  ArchiveWriter archive;
  archive(scan);
  scans.add(archive.bytes());
}

void RunRecord::for_each_scan(const std::function<void(const KeptScan&)>& take) const {
  scans.for_each([&take](std::string_view bytes) {
    KeptScan scan;
    ArchiveReader archive(bytes);
    archive(scan);
    take(scan);
  });
}

void RunRecord::add(const Step& step, const AddResult& added) {
  ++diagnostics.counts.steps;
  if (added.is_keyframe) ++diagnostics.counts.keyframes;
  if (!step.motion_known) ++diagnostics.counts.steps_with_unknown_motion;
  note_open_way(step);
  wheel_path.add(step);
  changes.add(step);
  mountings.add(step);
  note_tracking(step.observations.stamp, step.tracking_lost);
  if (added.loop_closed) ++diagnostics.counts.loops;
  if (step.scan) keep({*step.scan, false});
  if (step.obstacles) add_obstacles(*step.obstacles, step.T_body_levelled);
  if (step.ground) ground.add(step.observations.stamp, *step.ground, step.T_body_levelled);
  if (step.sight) sights.add(step.observations.stamp, *step.sight, step.observations.T_body_sensor);
}

// How far images in a row, or scans, left a direction of their motion open.
void RunRecord::note_open_way(const Step& step) {
  const bool scan = step.scan.has_value();
  if (step.open_direction) {
    ++(scan ? diagnostics.counts.scans_with_open_direction
            : diagnostics.counts.steps_with_open_direction);
  }
  double& way = scan ? open_scan_way_ : open_way_;
  way = step.open_direction ? way + step.motion.T_from_to.translation().norm() : 0;
  if (way == 0) return;
  Figure& longest = scan ? diagnostics.counts.scans_open_direction_longest_m
                         : diagnostics.counts.open_direction_longest_m;
  longest = std::max<double>(longest, way);
}

void RunRecord::note_tracking(Timestamp stamp, bool lost) {
  std::vector<LostSpan>& spans = diagnostics.tracking_lost;
  if (lost) {
    const double after = io::decimal_seconds(tracked_.value_or(stamp));
    ++diagnostics.counts.steps_with_tracking_lost;
    if (!diagnostics.counts.tracking_lost_after_s.known())
      diagnostics.counts.tracking_lost_after_s = after;
    if (!lost_) {
      constexpr std::size_t kMostLines = 5;  // metrics.json has them all
      if (spans.size() < kMostLines) {
        run_log().warn("tracking lost after {:.3f} s: the motion up to {:.3f} s is a guess", after,
                       stamp.seconds());
      }
      if (spans.size() < Diagnostics::kMostSpans) spans.push_back({after, std::nullopt});
    }
  } else {
    if (lost_ && !spans.empty() && !spans.back().until_s) {
      spans.back().until_s = io::decimal_seconds(stamp);
    }
    tracked_ = stamp;
  }
  lost_ = lost;
}

void RunRecord::take(const io::Session& session) {
  parts = session.parts;
  for (const KeptScan& scan : session.scans) keep(scan);
  rims.take(session.rims);
  ground.take(session.ground);
  sights.take(session.sights);
  diagnostics.counts = session.counts;
  diagnostics.skipped = session.skipped;
}

void RunRecord::add_obstacles(const ObstacleScan& obstacles, const SE3& T_body_levelled) {
  KeptScan scan{obstacles.to_laser_scan(), true};
  scan.scan.lidar.T_body_lidar = T_body_levelled;
  keep(scan);
  rims.add(obstacles, T_body_levelled);
}

void RunRecord::add_skipped(const SkippedCounts& skipped) {
  for (const auto& [why, count] : skipped) diagnostics.skipped[why] += count;
}

std::string skipped_text(const Diagnostics& diagnostics) {
  if (diagnostics.skipped.empty()) return "nothing was skipped";
  std::string text = "skipped:";
  for (const auto& [why, count] : diagnostics.skipped) text += fmt::format(" {} {};", count, why);
  text.pop_back();
  return text;
}

void RunRecord::set_refinement(const RefineResult& result, const Trajectory& before_it,
                               const Trajectory& after) {
  RefinementFigures refine;
  refine.solve_s = result.solve_s;
  refine.iterations = result.iterations;
  refine.status = to_string(result.status);
  double squares = 0;
  for (std::size_t i = 0; i < before_it.size() && i < after.size(); ++i) {
    squares += (before_it[i].pose.translation() - after[i].pose.translation()).squaredNorm();
  }
  if (!before_it.empty()) {
    refine.moved_rms_m = std::sqrt(squares / static_cast<double>(before_it.size()));
  }
  for (const CostChange& cost : result.costs) {
    refine.costs.push_back({cost.name, cost.before, cost.after});
  }
  diagnostics.counts.rejected_factors = static_cast<double>(result.rejected.size());
  before = before_it;
  diagnostics.refine = refine;
}

void RunRecord::go_on(std::span<const Step> steps) {
  for (const Step& step : steps)
    unmapped.emplace_back(step.observations.stamp, step.motion.T_from_to);
}

void RunRecord::before_each_item(const std::function<void()>& call) {
  for (Spool* spool : {&scans, &rims.seen(), &ground.seen(), &sights.seen()})
    spool->before_each(call);
}

}  // namespace lamina
