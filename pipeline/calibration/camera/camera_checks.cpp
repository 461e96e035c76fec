// Images, floors and wheels of a recording's beginning, put to the checks of cameras.
#include <lamina/pipeline/calibration/camera/camera_checks.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <lamina/models/error.hpp>
#include <lamina/pipeline/calibration/camera/camera_view_check.hpp>
#include <lamina/pipeline/calibration/camera/robot_pixels.hpp>
#include <lamina/pipeline/calibration/camera/stereo_check.hpp>

namespace lamina {
namespace {

constexpr std::int64_t kMostImages = 600;

// What pairs say, and what is done about it.
void take_pairs(const StereoFindings& found, CameraFindings& all) {
  if (found.swapped > 0) {
    all.fixes.swap_stereo = found.all_swapped();
    all.fixes.swap_some = !found.all_swapped();
    all.warnings.push_back(
        {"stereo_swapped",
         fmt::format("left and right images are swapped in {} of {} pairs, whose disparities are "
                     "negative; swapped back",
                     found.swapped, found.asked)});
  } else if (found.matched < 0.02) {
    all.warnings.push_back(
        {"stereo_unmatched",
         fmt::format("left and right images do not fit each other: {:.1f} % of the pixels match; "
                     "are they rectified, of one instant and one camera pair?",
                     100 * found.matched)});
  }
  if (found.right_late != 0) {
    all.fixes.right_late = found.right_late;
    all.warnings.push_back(
        {"stereo_late",
         fmt::format(
             "left and right images do not fit in turns: {} images are late by {} ({} of {} "
             "images in turns show the floor as stated then, {} as they are); paired anew",
             found.right_late > 0 ? "right" : "left", std::abs(found.right_late),
             found.floors_later, found.turns, found.floors)});
  } else if (found.turns_misfit) {
    all.warnings.push_back(
        {"stereo_late",
         fmt::format("left and right images do not fit in turns: {} of {} show the floor as stated "
                     "there, most straight on; are they of one instant?",
                     found.floors, found.turns)});
  }
}

// Codes for no measurement among depths.
void take_codes(const CameraLook& look, CameraFindings& all) {
  const auto code = look.codes().code();
  if (!code) return;
  all.fixes.depth_code = {code->least, code->most};
  const double raw = 0.5 * (code->least + code->most);
  all.warnings.push_back(
      {"no_return_code",
       fmt::format("depth {:.2f} m (raw {:.0f}) stands in {:.1f} % of the measured pixels, and "
                   "nothing near it: a code for no measurement, read as such",
                   raw / look.camera().depth_scale, raw, 100 * code->share)});
}

// Distances along rays for depths.
void take_rays(CameraLook& look, bool correct, CameraFindings& all) {
  const MountingCheckOptions options;
  const MountingVerdict as_is = look.verdict(all.fixes);
  CameraFixes rays = all.fixes;
  rays.depth.along_ray = true;
  const double before = look.flatness();
  const MountingVerdict by_rays = look.verdict(rays);
  const bool better = by_rays.stated.cost + options.wins_by < as_is.best.cost &&
                      by_rays.stated.floors > as_is.best.floors && look.flatness() > before;
  if (!better) return;
  if (correct) all.fixes.depth.along_ray = true;
  all.warnings.push_back(
      {"depth_along_ray",
       fmt::format(
           "depths are distances along each pixel's ray, not along the optical axis: floors "
           "and walls are flat only so ({} of {} images show the floor where T_body_camera "
           "says, {} as they are){}",
           by_rays.stated.floors, by_rays.images, as_is.stated.floors,
           correct ? "; corrected" : "; the map is of little use")});
}

// Parts of the robot in its own view.
void take_robot(CameraLook& look, CameraFindings& all) {
  const std::vector<bool> robot = look.robot(all.fixes);
  const auto pixels = std::count(robot.begin(), robot.end(), true);
  if (pixels == 0) return;
  all.fixes.robot = robot;
  all.warnings.push_back(
      {"robot_in_view",
       fmt::format("{:.1f} % of the depth image stays the same however the robot turns: a part of "
                   "the robot, or dirt on the lens; left out of all images",
                   100 * static_cast<double>(pixels) / static_cast<double>(robot.size()))});
}

// Whether an offset of disparities may be what looks like this mounting: it turns the floor's
// normal by itself times the height.
bool may_come_of_offset(const MountingVerdict& mounting, const SE3& stated) {
  if (!mounting.wrong) return !mounting.never_seen;
  const auto& T = mounting.best.correction.T_body_camera;
  if (!T || !mounting.best.id.starts_with("camera_tilt")) return false;
  const double turned = (stated.inverse() * *T).so3().log().norm();
  return turned < MountingCheckOptions().most_offset * T->translation().z();
}

// A constant of all disparities, if any, that pays. What else puts the floor elsewhere misleads
// walls as well.
std::optional<DepthOffset> offset_of(CameraLook& look, const CameraFixes& fixes,
                                     double least_gain) {
  if (!look.any()) return std::nullopt;
  const MountingVerdict mounting = look.verdict(fixes);
  if (!may_come_of_offset(mounting, look.camera().camera.T_body_camera)) return std::nullopt;
  const auto found = look.offset(fixes);
  if (!found || found->gain < least_gain) return std::nullopt;
  return found;
}

// Whether it is corrected. `look_on` has the camera seen from more places, to tell it from others.
bool take_offset(CameraLook& look, bool correct, bool stereo, const std::function<void()>& look_on,
                 CameraFindings& all) {
  const MountingCheckOptions options;
  if (!offset_of(look, all.fixes, options.clear_by)) return false;
  look_on();
  const auto found = offset_of(look, all.fixes, options.wins_by);
  if (!found || !found->clear) return false;
  const bool adopted = correct && found->adoption.adopted;
  const double fb = look.camera().noise.focal_baseline;
  const double px = found->value * fb;
  if (adopted) (stereo ? all.fixes.stereo : all.fixes.depth).offset = found->value;
  all.warnings.push_back(
      {"depth_offset",
       fmt::format("walls move as wheels say only if all disparities are {:+.2f} px off ({:+.4f} "
                   "1/m: {:.2f} m at 3 m){}{}",
                   px, found->value, 3 - 1 / (1 / 3.0 + found->value),
                   stereo ? ", as of images shifted against each other" : "",
                   adopted ? "; corrected" : "; not corrected, walls stand as far off")});
  return adopted;
}

// The floor against the mounting.
void take_mounting(CameraLook& look, bool correct, bool stereo, CameraFindings& all) {
  if (!look.any()) return;
  const MountingVerdict verdict = look.verdict(all.fixes);
  Warning warning = mounting_warning(verdict, look.camera().camera, correct);
  const auto largest = stereo ? std::nullopt : look.codes().common_largest();
  if (largest && 2 * verdict.stated.floors < verdict.images) {
    all.fixes.drop_depth = true;
    warning = {"depth_stretched",
               "the largest depth is the same in all images though they show different places: "
               "each was stretched to its own range, so that no metres can be read from them; "
               "depth images are not used"};
  } else if (verdict.wrong && correct) {
    CameraCorrection& fix = stereo ? all.fixes.stereo : all.fixes.depth;
    CameraCorrection correction = verdict.best.correction;  // of depths already corrected
    correction.offset = fix.offset;
    correction.along_ray = fix.along_ray;
    fix = correction;
  }
  // Where floor stands as stated, metres are right: the camera sees no further, and floor that ends
  // there has no edge.
  if (largest && !all.fixes.drop_depth)
    all.fixes.depth_reach = all.fixes.depth.depth * *largest / look.camera().depth_scale;
  if (!all.fixes.drop_depth) {
    Warning scatter = floor_scatter_warning(verdict, correct);
    all.floor_uneven = all.floor_uneven || scatter.id == "floor_uneven";
    if (!scatter.id.empty()) all.warnings.push_back(std::move(scatter));
  }
  if (verdict.never_seen && !(verdict.wrong && correct))
    all.no_ground =
        warning.id.empty() ? floor_unseen_warning(verdict, look.camera().camera) : Warning();
  if (!warning.id.empty()) all.warnings.push_back(std::move(warning));
}

// Pairs as they are after what was found of them.
void look_at_pairs(const std::vector<PairView>& pairs, const CameraFixes& fixes, CameraLook& look) {
  const std::size_t late = static_cast<std::size_t>(std::abs(fixes.right_late));
  for (std::size_t i = 0; i + late < pairs.size() && !look.done(); ++i) {
    StereoFrame pair = pairs[i].pair;
    const StereoFrame& later = pairs[i + late].pair;
    (fixes.right_late < 0 ? pair.left : pair.right) =
        fixes.right_late < 0 ? later.left : later.right;
    apply(fixes, pair);
    if (look.wants(pairs[i].T_odom_body)) look.add(depth_from_stereo(pair), pairs[i].T_odom_body);
  }
}

// What is read of a recording's beginning.
class FirstImages {
 public:
  FirstImages(Recording& recording, const FloorOptions& options)
      : depth(options, false), stereo(options, true), recording_(recording), options_(options) {}
  // Until depth images have shown enough.
  void read(const std::function<bool()>& ended);
  // Pairs anew, by what was found of them.
  void pair(const CameraFixes& fixes, bool on) {
    stereo = CameraLook(options_, true);
    if (on) stereo.look_on();
    look_at_pairs(pairs, fixes, stereo);
  }

  CameraLook depth, stereo;
  std::vector<PairView> pairs;

 private:
  std::optional<SE3> pose_at(Timestamp stamp) const {
    const bool now = odometry_ && std::abs(odometry_->stamp - stamp) < 0.02;
    return now ? std::optional(odometry_->T_odom_body) : std::nullopt;
  }

  Recording& recording_;
  const FloorOptions& options_;
  std::optional<Odometry> odometry_;
  std::int64_t images_ = 0;
  std::size_t bytes_ = 0;
};

void FirstImages::read(const std::function<bool()>& ended) {
  constexpr std::size_t kMostBytes = 64 << 20;
  while (images_ < kMostImages && bytes_ < kMostBytes && !depth.done() && !ended()) {
    auto measurement = recording_.next();
    if (!measurement) break;
    if (const auto* o = std::get_if<Odometry>(&*measurement)) odometry_ = *o;
    if (const auto* frame = std::get_if<DepthFrame>(&*measurement)) {
      ++images_;
      const auto pose = pose_at(frame->stamp);
      if (depth.wants(pose)) depth.add(*frame, pose);
    }
    if (auto* pair = std::get_if<StereoFrame>(&*measurement)) {
      ++images_;
      bytes_ += pair->left.size() + pair->right.size();
      const auto pose = pose_at(pair->stamp);
      pairs.push_back({std::move(*pair), pose});
    }
  }
}

}  // namespace

CameraFindings check_cameras(Recording& recording, const FloorOptions& options,
                             const std::function<bool()>& ended) {
  CameraFindings all;
  FirstImages first(recording, options);
  first.read(ended);
  if (ended()) return all;
  const bool correct = recording.calibration().odometry.planar && options.self_calibrate;
  if (!first.pairs.empty()) {
    take_pairs(check_pairs(first.pairs, options), all);
    first.pair(all.fixes, false);
    const auto on = [&] { first.pair(all.fixes, true); };
    if (take_offset(first.stereo, correct, true, on, all)) first.pair(all.fixes, false);
    take_mounting(first.stereo, correct, true, all);
  }
  if (first.depth.any()) {
    take_codes(first.depth, all);
    take_rays(first.depth, correct, all);
    take_robot(first.depth, all);
    const auto on = [&] {
      first.depth.look_on();
      first.read(ended);
    };
    take_offset(first.depth, correct, false, on, all);
    take_mounting(first.depth, correct, false, all);
  }
  return all;
}

}  // namespace lamina
