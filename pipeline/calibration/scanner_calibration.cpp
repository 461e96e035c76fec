// One look, and its words.
#include <lamina/pipeline/calibration/scanner_calibration.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/frontend.hpp>
#include <lamina/models/error.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

std::string causes_of(const ScanCorrection& correction) {
  std::string text;
  const auto add = [&text](const std::string& one) { text += (text.empty() ? "" : "; ") + one; };
  if (correction.mirrored)
    add("they turn against the wheels: reversed beam order (clockwise beams, an angle increment of "
        "the wrong sign), a scanner mounted upside down that is not said to be, or else odometry "
        "with left and right wheels swapped, which looks the same: then the map is a mirror image, "
        "and the wheels are to be put right");
  if (!correction.reversed.empty())
    add("in a part of the recording they turn against the wheels, in the rest with them: the order "
        "of beams changes on the way (a driver that was started anew with other settings, logs "
        "that were joined)");
  if (correction.aperture != 1)
    add(
        fmt::format("they turn by {:.2f} times what the wheels turn: the field of view is {:.2f} "
                    "times the stated one",
                    1 / correction.aperture, correction.aperture));
  if (correction.yaw != 0)
    add(
        fmt::format("the robot drives {:+.1f} deg away from where they have it drive: the scanner "
                    "does not face ahead as stated",
                    correction.yaw / kDegree));
  if (!correction.place.isZero())
    add(fmt::format("turns move them as a scanner {:.2f} m from where T_body_lidar has it",
                    correction.place.norm()));
  return text;
}

std::string done_for(const ScanCorrection& correction, double stated_yaw) {
  std::string text;
  const auto add = [&text](const std::string& one) { text += (text.empty() ? "" : ", ") + one; };
  if (correction.mirrored) add("beams mirrored");
  for (const Stretch& part : correction.reversed)
    add(fmt::format("beams {} from {} s {}", correction.mirrored ? "as stated" : "mirrored",
                    part.from.to_string(),
                    part.until ? "to " + part.until->to_string() + " s" : "on"));
  if (correction.aperture != 1) add(fmt::format("field of view x {:.3f}", correction.aperture));
  if (correction.yaw != 0)
    add(fmt::format("lidar yaw {:.1f} deg instead of {:.1f}",
                    std::remainder(stated_yaw + correction.yaw, 2 * M_PI) / kDegree,
                    stated_yaw / kDegree));
  if (!correction.place.isZero())
    add(fmt::format("lidar moved by x {:+.2f} y {:+.2f} m", correction.place.x(),
                    correction.place.y()));
  return text;
}

const char* id_of(const ScanCorrection& correction) {
  constexpr double kBackwards = 150 * kDegree;
  if (correction.mirrored || !correction.reversed.empty()) return "scan_mirrored";
  if (correction.aperture != 1) return "field_of_view";
  if (correction.yaw == 0) return "lidar_mounting";
  return std::abs(correction.yaw) > kBackwards ? "lidar_backwards" : "lidar_yaw";
}

// What is aboard, by its angles: "-12.0 to 4.5 deg at 0.40 m".
std::string sectors_of(const std::vector<OwnBeam>& own, const ScannerCheck::Found::Fan& fan) {
  std::string text;
  for (std::size_t i = 0; i < own.size();) {
    std::size_t end = i;
    double nearest = own[i].near;
    while (end < own.size() && own[end].any()) nearest = std::min(nearest, own[end++].near);
    if (end > i) {
      text += fmt::format("{}{:.1f} to {:.1f} deg from {:.2f} m on", text.empty() ? "" : ", ",
                          fan.angle(i) / kDegree, fan.angle(end - 1) / kDegree, nearest);
    }
    i = std::max(end, i + 1);
  }
  return text;
}

void report_own(const ScannerCheck::Found& found, bool adopted, Diagnostics& metrics) {
  const auto& own = found.correction.own;
  const auto beams =
      std::count_if(own.begin(), own.end(), [](const OwnBeam& beam) { return beam.any(); });
  metrics.warn(
      "robot_in_scans",
      fmt::format("{} of {} beams meet something that comes along with the robot (a part "
                  "of it, a load, a cart; {}): it keeps its range while the rest moves by, "
                  "and is seen past from elsewhere. Its returns {}",
                  beams, own.size(), sectors_of(own, found.fan),
                  adopted ? "were left out"
                          : "are in the map as if it stood there; offline they would be "
                            "left out"));
}

}  // namespace

std::optional<ScannerCheck::Found> check_scanner(Recording& recording,
                                                 const CalibrationOptions& settings,
                                                 const std::function<bool()>& ended) {
  if (!recording.calibration().odometry.planar) return std::nullopt;
  ScannerCheck check;
  WheelTrack wheels(recording.calibration().odometry);
  std::optional<Timestamp> last;
  try {
    while (!ended() && check.wants_more()) {
      const auto measurement = recording.next_light();
      if (!measurement) break;
      if (const auto* odometry = std::get_if<Odometry>(&*measurement)) wheels.add(*odometry);
      const auto* scan = std::get_if<LaserScan>(&*measurement);
      if (!scan || !is_level(scan->lidar.T_body_lidar, settings.scan_odometry.max_tilt)) continue;
      const auto moved = last ? wheels.between(*last, scan->stamp) : std::nullopt;
      check.add(*scan, moved ? std::optional(moved->T_from_to) : std::nullopt);
      last = scan->stamp;
      wheels.forget_before(scan->stamp);
    }
  } catch (const Error&) {  // the run itself comes to it, and says so
  }
  return ended() ? std::nullopt : check.found();
}

void place_changes(Recording& recording, const CalibrationOptions& settings,
                   ScannerCheck::Found& found, const std::function<bool()>& ended) {
  std::vector<Timestamp> at;
  for (const auto& change : found.changes) at.push_back(change.middle());
  std::vector<double> most(at.size(), 0);
  std::optional<LaserScan> last;
  try {
    while (!ended()) {
      const auto measurement = recording.next_light();
      if (!measurement) break;
      const auto* scan = std::get_if<LaserScan>(&*measurement);
      if (!scan || !is_level(scan->lidar.T_body_lidar, settings.scan_odometry.max_tilt)) continue;
      for (std::size_t k = 0; last && k < at.size(); ++k) {
        const auto& change = found.changes[k];
        if (last->stamp < change.from || change.to < scan->stamp) continue;
        const double reversal = ScannerCheck::reversal(*last, *scan);
        if (reversal <= most[k]) continue;
        most[k] = reversal;
        at[k] = last->stamp + 0.5 * (scan->stamp - last->stamp);
      }
      last = *scan;
    }
  } catch (const Error&) {  // the run itself comes to it, and says so
  }
  found.correction.reversed = ScannerCheck::stretches(at);
}

void report_scanner(const ScannerCheck::Found& found, const Calibration& stated, bool adopted,
                    Diagnostics& metrics) {
  const ScanCorrection& c = found.correction;
  if (!c.own.empty()) report_own(found, adopted, metrics);
  if (!c.misread()) return;
  const double yaw = stated.lidar ? stated.lidar->T_body_lidar.so3().yaw() : 0;
  metrics.warn(
      id_of(c),
      fmt::format("scans contradict the wheels (cost {:.0f} over {} pairs of scans, {:.0f} "
                  "so corrected): {}. {}: {}",
                  found.cost_stated, found.pairs, found.cost, causes_of(c),
                  adopted ? "Corrected"
                          : "Not corrected, the map is wrong; offline it "
                            "would be",
                  done_for(c, yaw)));
  const double score = found.gain();
  const auto note = [&](const char* parameter, double was, double is) {
    metrics.calibration.push_back({parameter, was, is, 0, score, adopted});
  };
  if (c.mirrored) note("lidar.beam_direction", 1, -1);
  if (!c.reversed.empty())
    note("lidar.beam_direction_changes", 0, static_cast<double>(found.changes.size()));
  if (c.aperture != 1) note("lidar.field_of_view_factor", 1, c.aperture);
  if (!c.place.isZero() && stated.lidar) {
    const Eigen::Vector3d was = stated.lidar->T_body_lidar.translation();
    note("lidar.x_m", was.x(), was.x() + c.place.x());
    note("lidar.y_m", was.y(), was.y() + c.place.y());
  }
  if (c.yaw != 0)
    note("lidar.yaw_deg", yaw / kDegree, std::remainder(yaw + c.yaw, 2 * M_PI) / kDegree);
}

}  // namespace lamina
