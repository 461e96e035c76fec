// Images, floors and wheels of a recording's beginning, put to the checks of cameras.
#include <lamina/apps/camera_checks.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <lamina/apps/stereo_check.hpp>
#include <lamina/frontend/floor/floor_frontend.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sensors/depth_codes.hpp>

namespace lamina::apps {
namespace {

constexpr std::int64_t kMostImages = 600;
constexpr std::size_t kMostViews = 40, kFewViews = 12;
constexpr double kTurned = 1.5;    // rad: without turns, mirror images pass for others
constexpr int kWithoutMotion = 5;  // images apart, where no wheels tell of motion

// Since the last view that was taken.
bool moved(const std::optional<SE3>& from, const std::optional<SE3>& to, int images) {
  constexpr double kWay = 0.1, kTurn = 0.08;  // m, rad
  if (!from || !to) return images >= kWithoutMotion;
  const SE3 T = from->inverse() * *to;
  return T.translation().norm() > kWay || T.so3().log().norm() > kTurn ||
         images >= 5 * kWithoutMotion;
}

// Depth cameras measure at metres: where these do not, by the usual factor that makes it so.
double usual_depth(double median_m) {
  constexpr double kLeast = 0.35, kMost = 7, kUsual = 2;  // m
  if (!(median_m > 0) || (median_m >= kLeast && median_m <= kMost)) return 1;
  double best = 1;
  for (const double factor : {5.0, 0.2, 10.0, 0.1, 1000.0, 0.001}) {
    if (std::abs(std::log(median_m * factor / kUsual)) <
        std::abs(std::log(median_m * best / kUsual)))
      best = factor;
  }
  return best;
}

// The planes of an image whose depths were multiplied by `depth` to find them.
MountingView view_of(const FloorResult& floor, double pixels, double depth,
                     const std::optional<SE3>& T_odom_body) {
  MountingView view;
  view.T_odom_body = T_odom_body;
  for (const ExtractedPlane& p : floor.planes) {
    const auto plane =
        Plane::from_normal_rho(p.plane_camera.normal(), p.plane_camera.rho() / depth);
    if (plane) view.planes.push_back({*plane, static_cast<double>(p.pixels) / pixels});
  }
  return view;
}

// The views of one camera.
class Look {
 public:
  Look(const FloorOptions& options, bool stereo)
      : options_(without_calibration(options)), stereo_(stereo) {}
  /// One more image came: is it a view, the robot moved since the last?
  bool wants(const std::optional<SE3>& T_odom_body) {
    ++since_;
    return !done() && (!any() || moved(views_.back().T_odom_body, T_odom_body, since_));
  }
  void add(const DepthFrame& frame, const std::optional<SE3>& T_odom_body) {
    since_ = 0;
    codes_.add(frame.raw);
    wheels_ = wheels_ || T_odom_body;
    if (any() && T_odom_body && views_.back().T_odom_body) {
      turned_ += (views_.back().T_odom_body->inverse() * *T_odom_body).so3().log().norm();
    }
    views_.push_back({frame, T_odom_body});
    add_view(views_.back());
  }
  bool any() const { return !views_.empty(); }
  /// Enough was seen.
  bool done() const {
    return views_.size() >= kMostViews ||
           (views_.size() >= kFewViews && (turned_ > kTurned || !wheels_) &&
            2 * check_->as_stated().floors >= views_.size());
  }
  MountingVerdict verdict(const CameraFixes& fixes);
  const DepthCodes& codes() const { return codes_; }
  const DepthCamera& camera() const { return views_.front().frame.camera; }

 private:
  struct View {
    DepthFrame frame;
    std::optional<SE3> T_odom_body;
  };
  static FloorOptions without_calibration(FloorOptions options) {
    options.self_calibrate = false;
    return options;
  }
  void add_view(const View& view, double depth = 1) {
    if (!check_) check_.emplace(view.frame.camera.camera.T_body_camera, stereo_);
    const double pixels = static_cast<double>(view.frame.width()) * view.frame.height();
    floor_.reset();
    check_->add(view_of(floor_.process(view.frame), pixels, depth, view.T_odom_body));
  }

  FloorOptions options_;
  bool stereo_;
  std::vector<View> views_;
  FloorFrontend floor_{options_};
  std::optional<MountingCheck> check_;
  DepthCodes codes_;
  int since_ = 0;
  bool wheels_ = false;
  double turned_ = 0;  // rad, over all views
};

// Once more, where codes stood among the depths or these lie where no camera measures.
MountingVerdict Look::verdict(const CameraFixes& fixes) {
  const double factor = stereo_ ? 1 : usual_depth(codes_.median() / camera().depth_scale);
  if (factor != 1 || fixes.depth_code) {
    check_.reset();
    for (View view : views_) {
      apply(fixes, view.frame);
      view.frame.camera.depth_scale /= factor;
      add_view(view, factor);
    }
  }
  return check_->verdict();
}

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
void take_codes(const Look& look, CameraFindings& all) {
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

// The floor against the mounting.
void take_mounting(Look& look, bool correct, bool stereo, CameraFindings& all) {
  if (!look.any()) return;
  const MountingVerdict verdict = look.verdict(all.fixes);
  Warning warning = mounting_warning(verdict, look.camera().camera, correct);
  if (!stereo && 2 * verdict.stated.floors < verdict.images && look.codes().stretched()) {
    all.fixes.drop_depth = true;
    warning = {"depth_stretched",
               "the largest depth is the same in all images though they show different places: "
               "each was stretched to its own range, so that no metres can be read from them; "
               "depth images are not used"};
  } else if (verdict.wrong && correct) {
    (stereo ? all.fixes.stereo : all.fixes.depth) = verdict.best.correction;
  }
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
void look_at_pairs(const std::vector<PairView>& pairs, const CameraFixes& fixes, Look& look) {
  const std::size_t late = static_cast<std::size_t>(std::abs(fixes.right_late));
  for (std::size_t i = 0; i + late < pairs.size() && !look.done(); ++i) {
    StereoFrame pair = pairs[i].pair;
    const StereoFrame& later = pairs[i + late].pair;
    (fixes.right_late < 0 ? pair.left : pair.right) =
        fixes.right_late < 0 ? later.left : later.right;
    if (fixes.swap_stereo || (fixes.swap_some && is_swapped(pair)))
      std::swap(pair.left, pair.right);
    if (look.wants(pairs[i].T_odom_body)) look.add(depth_from_stereo(pair), pairs[i].T_odom_body);
  }
}

}  // namespace

CameraFindings check_cameras(Recording& recording, const FloorOptions& options,
                             const std::function<bool()>& ended) {
  constexpr std::size_t kMostBytes = 64 << 20;
  CameraFindings all;
  Look depth(options, false), stereo(options, true);
  std::vector<PairView> pairs;
  std::optional<Odometry> odometry;
  const auto pose_at = [&odometry](Timestamp stamp) {
    const bool now = odometry && std::abs(odometry->stamp - stamp) < 0.02;
    return now ? std::optional(odometry->T_odom_body) : std::nullopt;
  };
  std::int64_t images = 0;
  std::size_t bytes = 0;
  while (images < kMostImages && bytes < kMostBytes && !depth.done() && !ended()) {
    auto measurement = recording.next();
    if (!measurement) break;
    if (const auto* o = std::get_if<Odometry>(&*measurement)) odometry = *o;
    if (const auto* frame = std::get_if<DepthFrame>(&*measurement)) {
      ++images;
      const auto pose = pose_at(frame->stamp);
      if (depth.wants(pose)) depth.add(*frame, pose);
    }
    if (auto* pair = std::get_if<StereoFrame>(&*measurement)) {
      ++images;
      bytes += pair->left.size() + pair->right.size();
      const auto pose = pose_at(pair->stamp);
      pairs.push_back({std::move(*pair), pose});
    }
  }
  if (ended()) return all;
  const bool planar = recording.calibration().odometry.planar;
  if (!pairs.empty()) {
    take_pairs(check_pairs(pairs, options), all);
    look_at_pairs(pairs, all.fixes, stereo);
    take_mounting(stereo, planar && options.self_calibrate, true, all);
  }
  if (depth.any()) {
    take_codes(depth, all);
    take_mounting(depth, planar && options.self_calibrate, false, all);
  }
  return all;
}

}  // namespace lamina::apps
