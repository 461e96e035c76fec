// What each cause predicts, and which of them costs least.
#include <lamina/frontend/depth/mounting_check.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/depth/leveling.hpp>

namespace lamina {
namespace {

constexpr double kLeastHeight = 0.1;                       // m: lower ones were not stated
constexpr double kAlikeTilt = 0.045, kAlikeHeight = 0.06;  // rad, share: one plane, met again
double square(double x) { return x * x; }

double tilt_of(const Eigen::Vector3d& normal_body) {
  return std::atan2(normal_body.head<2>().norm(), normal_body.z());
}

// By a hand, tilted as it may be.
MountingHypothesis held_along_x(const SE3& T_body_camera, double price) {
  MountingHypothesis held;
  held.id = "camera_optical_rotation";
  held.loose = true;
  held.correction.T_body_camera = T_body_camera;
  held.price = price;
  return held;
}

bool enough(std::size_t floors, std::size_t images, const MountingCheckOptions& options) {
  return floors >= options.least_images &&
         static_cast<double>(floors) >= options.least_share * static_cast<double>(images);
}

// Of hypotheses, the cheapest first: the next one of another cause that costs hardly more.
std::optional<MountingHypothesis> rival_of_first(const std::vector<MountingHypothesis>& all,
                                                 double hardly) {
  const MountingHypothesis& best = all.front();
  for (const MountingHypothesis& h : all) {
    if (h.id != best.id && !(h.cost > best.cost + hardly)) return h;
  }
  return std::nullopt;
}

}  // namespace

MountingCheck::MountingCheck(const SE3& T_body_camera, bool stereo,
                             const MountingCheckOptions& options)
    : T_body_camera_(T_body_camera),
      stereo_(stereo),
      height_stated_(T_body_camera.translation().z() >= kLeastHeight),
      options_(options) {}

void MountingCheck::add(MountingView view) {
  std::erase_if(view.planes, [this](const MountingView::Seen& seen) {
    return seen.share < options_.least_plane_share;
  });
  if (view.planes.empty()) {
    ++empty_;
  } else {
    views_.push_back(std::move(view));
  }
}

// A point X of the calibration stated is at M X by the true one: n . X = rho becomes
// (M^-T n) . X' = rho. M of a depth camera: depth * diag(1 / focal, 1 / focal, 1); of a stereo
// pair, whose depth goes with the focal length: depth * diag(1, 1, focal).
Plane MountingCheck::corrected(const Plane& plane, const CameraCorrection& c) const {
  Eigen::Vector3d n = plane.normal();
  n.z() -= c.offset * plane.rho();
  n /= c.depth;
  if (stereo_) n.z() /= c.focal;
  if (!stereo_) n.head<2>() *= c.focal;
  if (c.mirrored) n.x() = -n.x();
  return Plane::from_normal_rho(n, plane.rho()).value_or(plane);
}

double MountingCheck::floor_misfit(const Plane& seen, const CameraCorrection& c,
                                   double sigma_tilt) const {
  const SE3& T = c.T_body_camera ? *c.T_body_camera : T_body_camera_;
  const Plane plane = corrected(seen, c);
  const double tilt = tilt_of(T.so3() * plane.normal());
  const double height = -plane.rho(), expected = T.translation().z();
  double misfit = square(tilt / sigma_tilt);
  if (height_stated_ || (c.T_body_camera && sigma_tilt == options_.sigma_tilt)) {
    const double sigma = options_.sigma_height * expected + options_.sigma_height_m;
    misfit += square((height - expected) / sigma);
  } else if (height < kLeastHeight) {
    return options_.truncate;
  }
  return std::min(misfit, options_.truncate);
}

bool MountingCheck::shows_floor(const std::vector<MountingView::Seen>& planes) const {
  return std::any_of(planes.begin(), planes.end(), [this](const MountingView::Seen& seen) {
    return seen.share >= options_.least_plane_share &&
           floor_misfit(seen.plane_camera, {}, options_.sigma_tilt) < options_.fits;
  });
}

void FloorsAsStated::add(const DepthFrame& frame, const FloorResult& floor) {
  const double pixels = static_cast<double>(frame.width()) * frame.height();
  std::vector<MountingView::Seen> planes;
  for (const ExtractedPlane& p : floor.planes)
    planes.push_back({p.plane_camera, static_cast<double>(p.pixels) / pixels});
  ++images;
  floors += MountingCheck(frame.camera.camera.T_body_camera, false).shows_floor(planes);
}

// Where wheels tell how the camera moved, what stands is met again where that says.
double MountingCheck::motion_cost(const CameraCorrection& c) const {
  constexpr double kLeastWay = 0.1, kLeastTurn = 0.08, kMostWay = 1.5, kMostTurn = 0.6;  // m, rad
  const SE3& T_body_camera = c.T_body_camera ? *c.T_body_camera : T_body_camera_;
  double cost = 0;
  for (std::size_t i = 1; i < views_.size(); ++i) {
    const MountingView &from = views_[i - 1], &to = views_[i];
    if (!from.T_odom_body || !to.T_odom_body) continue;
    const SE3 T_to_from = to.T_odom_body->inverse() * *from.T_odom_body;
    const double way = T_to_from.translation().norm(), turn = T_to_from.so3().log().norm();
    if ((way < kLeastWay && turn < kLeastTurn) || way > kMostWay || turn > kMostTurn) continue;
    const SE3 T = T_body_camera.inverse() * T_to_from * T_body_camera;
    for (const MountingView::Seen& seen : from.planes) {
      const Plane expected = T * corrected(seen.plane_camera, c);
      double least = options_.truncate;
      for (const MountingView::Seen& other : to.planes) {
        const Plane plane = corrected(other.plane_camera, c);
        const double sigma = options_.sigma_wall * (1 + std::abs(plane.rho()));
        least = std::min(least, square(angle_between(plane, expected) / options_.sigma_wall_tilt) +
                                    square((plane.rho() - expected.rho()) / sigma));
      }
      cost += least;
    }
  }
  return cost;
}

void MountingCheck::score(MountingHypothesis& h) const {
  h.cost = h.price + motion_cost(h.correction) + static_cast<double>(empty_) * options_.truncate;
  h.floors = 0;
  const double sigma = h.loose ? options_.sigma_hand : options_.sigma_tilt;
  for (const MountingView& view : views_) {
    double least = options_.truncate;
    for (const MountingView::Seen& seen : view.planes) {
      least = std::min(least, floor_misfit(seen.plane_camera, h.correction, sigma));
    }
    h.floors += least < options_.fits;
    h.cost += least;
  }
}

// What the camera sees at one place, whatever the robot does: the floor, or what lies level.
std::vector<MountingCheck::Steady> MountingCheck::steady_planes() const {
  std::vector<Steady> all;
  for (const MountingView& view : views_) {
    for (const MountingView::Seen& seed : view.planes) {
      Steady steady{seed.plane_camera, 0};
      const auto alike = [&](const MountingView::Seen& other) {
        return angle_between(other.plane_camera, steady.plane) < kAlikeTilt &&
               std::abs(other.plane_camera.rho() / steady.plane.rho() - 1) < kAlikeHeight;
      };
      for (const MountingView& other : views_) {
        steady.images += std::any_of(other.planes.begin(), other.planes.end(), alike);
      }
      all.push_back(steady);
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Steady& a, const Steady& b) { return a.images > b.images; });
  constexpr std::size_t kMost = 4;
  std::vector<Steady> chosen;
  for (const Steady& one : all) {
    const bool known = std::any_of(chosen.begin(), chosen.end(), [&](const Steady& other) {
      return angle_between(one.plane, other.plane) < 2 * kAlikeTilt &&
             std::abs(one.plane.rho() / other.plane.rho() - 1) < 2 * kAlikeHeight;
    });
    if (known || chosen.size() == kMost || one.images < options_.least_images) continue;
    chosen.push_back(one);
  }
  return chosen;
}

bool MountingCheck::looks_up() const {
  return (T_body_camera_.so3() * Eigen::Vector3d::UnitZ()).z() > std::cos(options_.most_tilt);
}

SE3 MountingCheck::mounted(const SO3& R, double height) const {
  const Eigen::Vector3d& t = T_body_camera_.translation();
  return SE3(R, {t.x(), t.y(), height_stated_ ? t.z() : height});
}

void MountingCheck::add_tilted(const Plane& floor, std::vector<MountingHypothesis>& all) const {
  const Leveling l = leveling_of(T_body_camera_, floor);
  const double tilt = std::hypot(l.roll, l.pitch);
  if (!(tilt < options_.most_tilt) || !(l.height > kLeastHeight)) return;
  const double expected = T_body_camera_.translation().z();
  const bool as_high = std::abs(l.height - expected) <
                       2 * (options_.sigma_height * expected + options_.sigma_height_m);
  MountingHypothesis h;
  h.tilt = tilt;
  h.ratio = l.height / expected;
  h.id = as_high ? "camera_tilt" : "camera_mounting";
  h.correction.T_body_camera = apply(l, T_body_camera_);
  h.price = options_.price_known + (h.id == "camera_tilt" ? 2 : 3) * options_.price_free;
  all.push_back(h);
}

// Heading and mirror images: level floors lie alike, but walls do not move as wheels say.
std::optional<MountingHypothesis> MountingCheck::by_motion(const MountingHypothesis& base) const {
  std::optional<MountingHypothesis> best;
  const auto ask = [&](const char* id, double yaw, bool mirrored) {
    MountingHypothesis h = base;
    h.id = id;
    h.by_motion = true;
    h.ratio = yaw;
    h.price += options_.price_known;
    const SE3 T = base.correction.T_body_camera.value_or(T_body_camera_);
    if (yaw != 0) h.correction.T_body_camera = SE3(SO3::rot_z(yaw) * T.so3(), T.translation());
    h.correction.mirrored = mirrored;
    score(h);
    if (h.cost + options_.wins_by < base.cost && 10 * h.floors >= 8 * base.floors &&
        (!best || h.cost < best->cost)) {
      best = h;
    }
  };
  ask("camera_mirrored", 0, true);
  for (const double yaw : {M_PI / 2, -M_PI / 2, M_PI}) ask("camera_heading", yaw, false);
  return best;
}

MountingHypothesis MountingCheck::as_stated() const {
  MountingHypothesis stated;
  score(stated);
  return stated;
}

MountingVerdict MountingCheck::verdict() const {
  MountingVerdict verdict;
  verdict.images = views_.size();
  verdict.stated = as_stated();
  verdict.best = verdict.stated;
  std::vector<MountingHypothesis> all;
  if (!height_stated_ && looks_up()) {
    const SE3 ahead = mounted(T_body_camera_.so3() * forward_looking_camera().so3(), 0);
    all.push_back(held_along_x(ahead, options_.price_known));
  }
  for (const Steady& steady : steady_planes()) add_causes(steady.plane, all);
  for (MountingHypothesis& h : all) score(h);
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.cost < b.cost; });
  const FloorsAsStated floors{static_cast<std::int64_t>(views_.size()),
                              static_cast<std::int64_t>(verdict.stated.floors)};
  verdict.never_seen =
      views_.size() >= options_.least_images && height_stated_ && floors.hardly_any();
  if (!all.empty()) {
    const MountingHypothesis& best = all.front();
    verdict.wrong = enough(best.floors, views_.size(), options_) &&
                    best.floors > 2 * verdict.stated.floors &&
                    best.cost + options_.wins_by < verdict.stated.cost;
    if (verdict.wrong) {
      verdict.best = best;
      verdict.rival = rival_of_first(all, options_.clear_by);
    }
  }
  if (enough(verdict.best.floors, views_.size(), options_)) {
    if (const auto turned = by_motion(verdict.best)) {
      verdict.best = *turned;
      verdict.wrong = true;
      verdict.rival.reset();
    }
  }
  add_scatter(verdict);
  return verdict;
}

}  // namespace lamina
