// Views, as they are and corrected.
#include <lamina/pipeline/calibration/camera/camera_view_check.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/pipeline/calibration/camera/robot_pixels.hpp>

namespace lamina {
namespace {

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

FloorOptions without_calibration(FloorOptions options) {
  options.self_calibrate = false;
  return options;
}

}  // namespace

CameraLook::CameraLook(const FloorOptions& options, bool stereo)
    : options_(without_calibration(options)), stereo_(stereo) {}

bool CameraLook::wants(const std::optional<SE3>& T_odom_body) {
  ++since_;
  return !done() && (!any() || moved(views_.back().T_odom_body, T_odom_body, since_));
}

void CameraLook::add(const DepthFrame& frame, const std::optional<SE3>& T_odom_body) {
  since_ = 0;
  codes_.add(frame.raw);
  wheels_ = wheels_ || T_odom_body;
  if (any() && T_odom_body && views_.back().T_odom_body) {
    turned_ += (views_.back().T_odom_body->inverse() * *T_odom_body).so3().log().norm();
  }
  views_.push_back({frame, T_odom_body});
  add_view(views_.back());
}

bool CameraLook::done() const {
  return views_.size() >= kMostViews ||
         (!looks_on_ && views_.size() >= kFewViews && (turned_ > kTurned || !wheels_) &&
          2 * check_->as_stated().floors >= views_.size());
}

void CameraLook::add_view(const View& view, double depth) {
  if (!check_) check_.emplace(view.frame.camera.camera.T_body_camera, stereo_);
  const double pixels = static_cast<double>(view.frame.width()) * view.frame.height();
  floor_.reset();
  MountingView seen = view_of(floor_.process(view.frame), pixels, depth, view.T_odom_body);
  for (const MountingView::Seen& plane : seen.planes) flat_ += plane.share;
  check_->add(std::move(seen));
}

// Once more, where codes stood among the depths or these lie where no camera measures.
void CameraLook::look_again(const CameraFixes& fixes) {
  const double factor = stereo_ ? 1 : usual_depth(codes_.median() / camera().depth_scale);
  const bool changes = factor != 1 || fixes.changes_depths();
  if (!changes && !changed_) return;
  changed_ = changes;
  check_.reset();
  flat_ = 0;
  for (View view : views_) {
    apply_to_depths(fixes, view.frame);
    view.frame.camera.depth_scale /= factor;
    add_view(view, factor);
  }
}

MountingVerdict CameraLook::verdict(const CameraFixes& fixes) {
  look_again(fixes);
  return check_->verdict();
}

std::optional<DepthOffset> CameraLook::offset(const CameraFixes& fixes) {
  look_again(fixes);
  return check_->depth_offset();
}

double CameraLook::flatness() const { return flat_ / static_cast<double>(views_.size()); }

std::vector<bool> CameraLook::robot(const CameraFixes& fixes) {
  const MountingHypothesis best = verdict(fixes).best;
  const MountingCheckOptions options;
  if (static_cast<double>(best.floors) < options.least_share * static_cast<double>(views_.size()))
    return {};
  std::vector<PosedImage> images;
  for (const View& view : views_) {
    if (view.T_odom_body) images.push_back({&view.frame, *view.T_odom_body});
  }
  return robot_pixels(images, check_->levelled(best.correction));
}

}  // namespace lamina
