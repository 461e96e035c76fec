// Turns by images against those of the wheels, in words.
#include <lamina/pipeline/calibration/camera/camera_time_offset.hpp>

#include <fmt/format.h>

#include <cmath>

#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/pipeline/calibration/camera/image_turns.hpp>
#include <lamina/pipeline/calibration/turn_claims.hpp>

namespace lamina {
namespace {

constexpr std::size_t kAsked = 60, kMost = 240;  // pieces told: without a contradiction, at most

Warning smeared(const TurnClaims::Found& found, std::size_t pieces) {
  return {"depth_smeared",
          fmt::format("depth images turn later than the wheels and by and by, as if each were a "
                      "mean over {:.2g} s ({} of {} turns between images fit only so): a temporal "
                      "filter, or one of the driver's, smears what is seen while the robot moves. "
                      "Their motion is not used; walls and obstacles may stand off by as much as "
                      "the robot moves in that time: record without the filter",
                      found.best.kind == TurnClaim::Kind::kAveraged ? found.best.value
                                                                    : 2 * found.best.value,
                      found.mended, pieces)};
}

Warning off(const TurnClaims::Found& found, std::size_t pieces, bool correct) {
  const double d = found.best.value;
  return {"camera_clock",
          fmt::format("images' stamps are {:.2f} s {} against the odometry's ({} of {} turns "
                      "between images fit only so); {}",
                      std::abs(d), d < 0 ? "late" : "early", found.mended, pieces,
                      correct ? "corrected" : "clocks.find is off: left as they are")};
}

// Images that were matched where turns begin and end, and those among them that fit nowhere.
struct Matched {
  std::size_t all = 0, unexplained = 0;
  bool nowhere = false;  // without wheels neither
  void add(const ImageTurn& turn) {
    all += turn.matched;
    unexplained += turn.matched && !turn.explained;
  }
  // Of sound images a tenth fits nowhere.
  bool doubtful() const {
    return all >= ScannerCheckOptions().least_pairs && 4 * unexplained > all;
  }
};

Warning distorted(const Matched& matched) {
  return {"depth_distorted",
          fmt::format("depth images do not fit each other wherever they are laid ({} of {} where "
                      "turns begin and end): depth that bends (a lens, a calibration) or that is "
                      "noisier than stated. Their motion is not used, the wheels' is; walls and "
                      "floors are as bent as the images",
                      matched.unexplained, matched.all)};
}

// Laid without wheels, which may be what is wrong, while these move.
bool distorted_alone(Recording& recording, const WheelTrack& wheels,
                     const std::function<bool()>& ended) {
  DepthOdometry odometry;
  Matched matched;
  std::optional<Timestamp> last;
  while (!ended() && matched.all < kAsked) {
    const auto frame = next_image(recording, 0);
    if (!frame) break;
    const auto moved = last ? wheels.between(*last, frame->stamp) : std::nullopt;
    const DepthMotion motion = odometry.process(*frame);
    const bool moves = moved && moved->T_from_to.log().norm() > ScannerCheckOptions().sigma_turn;
    matched.add({frame->stamp, frame->stamp, 0, 0, false, moves, motion.explained});
    last = frame->stamp;
  }
  return 2 * matched.unexplained > matched.all;
}

// At most some hundred images.
std::optional<TurnClaims::Found> look(const std::function<std::unique_ptr<Recording>()>& open,
                                      const std::function<bool()>& ended, TurnClaims& claims,
                                      Matched& matched) {
  const Wheels wheels = wheels_of(*open(), ended);
  if (!wheels.track.moved()) return std::nullopt;
  std::size_t ask_at = kAsked;
  turns_by_images(*open(), wheels, {}, TurnClaims::kRange, ended, [&](const ImageTurn& turn) {
    matched.add(turn);
    if (turn.observed) claims.add(turn.from, turn.to, turn.yaw, turn.sigma);
    if (matched.all >= kMost) return false;
    if (claims.pieces() < ask_at) return true;
    ask_at = kMost;
    return claims.pieces() < kMost && claims.contradicted(wheels.turns);
  });
  if (ended()) return std::nullopt;
  matched.nowhere = matched.doubtful() && distorted_alone(*open(), wheels.track, ended);
  return claims.found(wheels.turns);
}

}  // namespace

void look_at_camera_clock(const std::function<std::unique_ptr<Recording>()>& open,
                          const Calibration& sensors, ClockOffsets& clocks,
                          CalibrationOptions& settings, std::vector<Warning>& warnings,
                          const std::function<bool()>& ended) {
  // Motions by stretched depth are stretched, too: they must not stand against those of wheels.
  for (const Warning& said : warnings)
    if (said.id == "depth_stretched") settings.images_beside_wheels = false;
  if (!sensors.odometry.planar || !(sensors.depth_camera || sensors.stereo_camera)) return;
  const ClockOffsets stated = clocks;
  TurnClaims claims;
  Matched matched;
  const auto found = look([&] { return reclocked(open(), stated); }, ended, claims, matched);
  if (!found && matched.nowhere) {
    settings.images_beside_wheels = false;
    warnings.push_back(distorted(matched));
  }
  if (!found) return;
  if (found->best.smeared()) {
    settings.images_beside_wheels = false;
    warnings.push_back(smeared(*found, claims.pieces()));
    return;
  }
  warnings.push_back(off(*found, claims.pieces(), settings.find_clocks));
  if (!settings.find_clocks) return;
  (sensors.lidar ? clocks.camera : clocks.odometry) += (sensors.lidar ? 1 : -1) * found->best.value;
}

void note_clocks(const ClockOffsets& clocks, const CalibrationOptions& settings,
                 Diagnostics& metrics) {
  const double camera = clocks.camera + settings.camera_delay;
  const double odometry = clocks.odometry + settings.odometry_delay;
  if (camera != 0) metrics.counts.camera.clock_ms = 1000 * camera;
  if (odometry != 0) metrics.counts.odometry.clock_ms = 1000 * odometry;
}

}  // namespace lamina
