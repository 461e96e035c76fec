// One look over scans and odometry, one over the images taken where turns begin and end.
#include <lamina/pipeline/calibration/time_offset.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <lamina/frontend/frontend.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/calibration/calibration_report.hpp>
#include <lamina/pipeline/calibration/camera/image_turns.hpp>
#include <lamina/pipeline/calibration/report.hpp>

namespace lamina {
namespace {

constexpr double kSure = 0.002;            // s, sigma: more would change nothing
constexpr std::size_t kFirstAsked = 100;   // pieces; then at twice as many, and so on
constexpr std::int64_t kMostImages = 800;  // to be matched

struct Look {
  const std::function<std::unique_ptr<Recording>()>& open;
  const CalibrationOptions& settings;
  const std::optional<double>& sweep;
  const DepthDistortion& distortion;
  const std::function<bool()>& ended;
  bool camera = false;  // a depth camera is there
};

// Asked now and then, until it is sure.
class Asked {
 public:
  explicit Asked(const TurnTrack& turns) : turns_(turns) {}
  ClockOffset offset;
  bool sure() {
    if (!sure_ && offset.pieces() >= ask_at_) {
      ask_at_ *= 2;
      const auto result = offset.result(turns_);
      sure_ = result && result->sigma < kSure && result->stretches >= 8;
    }
    return sure_;
  }

 private:
  const TurnTrack& turns_;
  std::size_t ask_at_ = kFirstAsked;
  bool sure_ = false;
};

// Odometry further apart than a delay says too little of what was between to be moved by that.
constexpr double kSlowest = 0.15;      // s: few delays are longer
constexpr std::size_t kCounted = 100;  // odometry, to know its interval by
constexpr double kNears = 0.25;        // of the offset, left after the first step
constexpr int kWithout = 50;           // scans before any odometry: there is none

std::optional<ClockOffset::Result> by_scans(const Look& look, Wheels& wheels) {
  const auto recording = look.open();
  FrontEnd front_end(look.settings, recording->calibration());
  if (look.sweep) {
    front_end.motion().scan_duration().set(*look.sweep);
    front_end.motion().wheels().use_whole(all_wheels(*look.open(), look.ended));
  }
  Diagnostics aside;
  Asked asked(wheels.turns);
  std::optional<Timestamp> last;
  std::optional<SE3> T_body_lidar;
  bool one = true;
  int without = 0;
  try {
    while (!look.ended()) {
      const auto measurement = recording->next_light();
      if (!measurement) break;
      if (const auto* odometry = std::get_if<Odometry>(&*measurement)) wheels.add(*odometry);
      if (asked.sure() || !one) continue;
      if (!look.camera && wheels.count >= kCounted && wheels.interval() > kSlowest)
        return std::nullopt;
      const auto step = front_end.process(*measurement, aside);
      if (!step || !step->scan_motion) continue;
      if (wheels.count == 0 && ++without >= kWithout) return std::nullopt;
      const SE3& T = std::get<LaserScan>(*measurement).lidar.T_body_lidar;
      if (!T_body_lidar) T_body_lidar = T;
      one = (T_body_lidar->inverse() * T).log().norm() < 1e-9;
      const auto& moved = step->scan_motion->by_scans_alone;
      if (last && moved) asked.offset.add(*last, step->scan->stamp, moved->so3().yaw());
      last = step->scan->stamp;
    }
  } catch (const Error&) {  // the run itself comes to it, and says so
  }
  return one ? asked.offset.result(wheels.turns) : std::nullopt;
}

std::optional<ClockOffset::Result> by_images(const Look& look, const Wheels& wheels) {
  constexpr double kAround = 0.5;     // s
  constexpr double kObserved = 0.02;  // rad, sigma
  Asked asked(wheels.turns);
  std::int64_t matched = 0;
  const auto take = [&](const ImageTurn& turn) {
    if (turn.observed && turn.sigma < kObserved)
      asked.offset.add(turn.from, turn.to, turn.yaw, std::max(turn.sigma, 0.001));
    return ++matched < kMostImages && !asked.sure();
  };
  turns_by_images(*look.open(), wheels, look.distortion, kAround, look.ended, take);
  return asked.offset.result(wheels.turns);
}

FoundClocks look_at(const Look& look) {
  const auto recording = look.open();
  Wheels wheels(recording->calibration().odometry);
  FoundClocks found;
  found.scanner = by_scans(look, wheels);
  found.odometry_interval = wheels.interval();
  if (look.camera && wheels.track.moved() && !look.ended()) found.camera = by_images(look, wheels);
  if (look.ended()) return {};
  return found;
}

void tell(const char* sensor, double offset, double sigma, double& stamps, Diagnostics& metrics) {
  if (offset == 0) return;
  report_change(std::string(sensor) + ".delay_s", -stamps, -stamps - offset, sigma, metrics);
  stamps += offset;
  metrics.counts.of(sensor).clock_ms += 1000 * offset;
}

}  // namespace

FoundClocks find_clocks(const OpenReclocked& open, const CalibrationOptions& settings,
                        const std::optional<double>& sweep, const DepthDistortion& distortion,
                        const std::function<bool()>& ended) {
  ClockOffsets offsets;
  const std::function<std::unique_ptr<Recording>()> as_corrected = [&] { return open(offsets); };
  const bool camera = as_corrected()->calibration().depth_camera.has_value();
  const Look look{as_corrected, settings, sweep, distortion, ended, camera};
  FoundClocks found = look_at(look);
  found.scanner_observed = found.scanner;
  found.camera_observed = found.camera;
  const auto drop = [](std::optional<ClockOffset::Result>& one) {
    if (one && !one->is_significant()) one.reset();
  };
  drop(found.scanner);
  drop(found.camera);
  if (!found.scanner && !found.camera) return found;
  const auto microseconds = [](double s) { return 1e-6 * std::round(1e6 * s); };
  const auto value = [&](const std::optional<ClockOffset::Result>& one) {
    return one ? microseconds(one->value) : 0;
  };
  offsets = {value(found.scanner), value(found.camera), 0};
  const FoundClocks left = look_at(look);
  const auto add = [&](std::optional<ClockOffset::Result>& one,
                       const std::optional<ClockOffset::Result>& more) {
    if (!one) return;
    // Scans straightened by velocities of the wrong instant come to the right one step by step.
    const bool nears = sweep && more && std::abs(more->value) < kNears * std::abs(one->value);
    const bool stays = more && (nears || !more->is_significant());
    if (!stays) return one.reset();
    one->value = microseconds(one->value + more->value);
    one->sigma = more->sigma;
  };
  add(found.scanner, left.scanner);
  add(found.camera, left.camera);
  return found;
}

// What is added to a sensor's stamps where the odometry is `late` (s). Nothing found is no sign
// that they are as late: that must be told, by more than chance against being right.
static double beside_late_odometry(const std::optional<ClockOffset::Result>& found,
                                   const std::optional<ClockOffset::Result>& observed,
                                   double late) {
  constexpr double kSigmas = 3;
  if (found) return found->value - late;
  const bool with_odometry = observed &&
                             std::abs(observed->value) < std::abs(observed->value - late) &&
                             late - observed->value > kSigmas * observed->sigma;
  return with_odometry ? -late : 0;
}

// No stamp is put before what it says was measured: the earliest clock is right. One that is off it
// by no more than chance is the same.
ClockOffsets by_earliest(const FoundClocks& found) {
  const auto value = [](const std::optional<ClockOffset::Result>& one) {
    return one ? one->value : 0;
  };
  const double scanner = value(found.scanner), camera = value(found.camera);
  const double most = std::max({0.0, scanner, camera});
  if (most == 0) return {scanner, camera, 0};
  bool same = false;
  if (found.scanner && found.camera) {
    ClockOffset::Result apart = *found.scanner;
    apart.value -= found.camera->value;
    apart.sigma = std::hypot(apart.sigma, found.camera->sigma);
    same = !apart.is_significant();
  }
  if (same) return {0, 0, -most};
  return {beside_late_odometry(found.scanner, found.scanner_observed, most),
          beside_late_odometry(found.camera, found.camera_observed, most), -most};
}

ClockOffsets by_scanner(const FoundClocks& found) {
  return {0, 0, found.scanner ? -found.scanner->value : 0};
}

bool correct_clocks(ClockOffsets& clocks, const OpenReclocked& open,
                    const CalibrationOptions& settings, const std::optional<double>& sweep,
                    const DepthDistortion& distortion, Diagnostics& metrics,
                    const std::function<bool()>& ended) {
  const OpenReclocked on_top = [&](const ClockOffsets& more) {
    return open({clocks.scanner + more.scanner, clocks.camera + more.camera,
                 clocks.odometry + more.odometry});
  };
  const bool camera = open(clocks)->calibration().depth_camera.has_value();
  FoundClocks found = find_clocks(on_top, settings, sweep, distortion, ended);
  // Moved by less than from one odometry to the next, what it says at scans' stamps would be a
  // guess; and wheels that slip look late now and then.
  constexpr double kKnown = 0.01;  // s, sigma
  if (!camera && found.scanner &&
      (std::abs(found.scanner->value - clocks.odometry) < found.odometry_interval ||
       found.scanner->sigma > kKnown))
    found.scanner.reset();
  const auto sigma = [](const std::optional<ClockOffset::Result>& one) {
    return one ? one->sigma : 0;
  };
  const double of_scanner = sigma(found.scanner), of_camera = sigma(found.camera);
  const ClockOffsets offsets = camera ? by_earliest(found) : by_scanner(found);
  const bool scanner_is_earliest = found.scanner && found.scanner->value == -offsets.odometry;
  const double of_earliest =
      offsets.odometry == 0 ? 0 : (scanner_is_earliest ? of_scanner : of_camera);
  tell("odometry", offsets.odometry, of_earliest, clocks.odometry, metrics);
  tell("scanner", offsets.scanner, std::hypot(of_scanner, of_earliest), clocks.scanner, metrics);
  tell("camera", offsets.camera, std::hypot(of_camera, of_earliest), clocks.camera, metrics);
  return offsets.any();
}

}  // namespace lamina
