// The floor, the mounting and the kinds of planes.
#include <lamina/frontend/depth/floor_judge.hpp>

#include <cmath>

#include <lamina/frontend/depth/leveling.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
// Frames in a row that must show the same other floor before calibration is called wrong.
constexpr int kContradictionsToReject = 30;

// Covariance of the plane as seen from the camera: (tilt, tilt, rho at the camera).
Eigen::Matrix3d floor_covariance(const ExtractedPlane& plane) {
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  const auto fit = plane.moments_camera.fit_plane(Eigen::Vector3d::Zero(), 1.0);
  if (fit) C = fit->covariance;
  C.diagonal() += Eigen::Vector3d(plane.floor.sigma_tilt * plane.floor.sigma_tilt,
                                  plane.floor.sigma_tilt * plane.floor.sigma_tilt,
                                  plane.floor.sigma_rho * plane.floor.sigma_rho);
  const Eigen::Vector3d foot = plane.plane_camera.project(Eigen::Vector3d::Zero());
  const double lever2 = (plane.moments_camera.mean() - foot).squaredNorm();
  C(2, 2) += lever2 * 0.5 * (C(0, 0) + C(1, 1));
  return C;
}

}  // namespace

bool FloorJudge::calibration_usable(const SE3& T) const {
  return !calibration_wrong_ && T.translation().z() >= options_.min_height_m;
}

FloorPrior FloorJudge::prior(const SE3& calibrated) const {
  if (calibration_usable(calibrated)) {
    if (!tracker_.started() || !options_.self_calibrate) {
      return {calibrated, MountingKnowledge::kCalibrated};
    }
    return {tracker_.estimate().T_body_camera, MountingKnowledge::kTracked};
  }
  if (last_leveled_) return {*last_leveled_, MountingKnowledge::kFollowed};
  return {calibrated, MountingKnowledge::kUnknown};
}

// A calibration that is contradicted frame after frame by one and the same floor is wrong.
void FloorJudge::suspect_calibration(const FloorChoice& without,
                                     std::span<const FloorCandidate> candidates) {
  if (without.status != FloorStatus::kFound) {
    contradictions_ = 0;
    return;
  }
  const double height = -candidates[static_cast<std::size_t>(without.index)].plane_camera.rho();
  contradictions_ =
      contradictions_ > 0 && std::abs(height - suspected_height_) < 0.03 ? contradictions_ + 1 : 1;
  suspected_height_ = height;
  if (contradictions_ >= kContradictionsToReject) calibration_wrong_ = true;
}

FloorChoice FloorJudge::choose(const SE3& calibrated, std::span<const FloorCandidate> candidates,
                               double frame_pixels) {
  const FloorPrior expected = prior(calibrated);
  FloorChoice choice = choose_floor(candidates, frame_pixels, expected, options_);
  if (choice.status == FloorStatus::kFound) {
    contradictions_ = 0;
    return choice;
  }
  if (expected.knowledge == MountingKnowledge::kUnknown) return choice;
  const FloorChoice without =
      choose_floor(candidates, frame_pixels, {calibrated, MountingKnowledge::kUnknown}, options_);
  if (expected.knowledge == MountingKnowledge::kFollowed) return without;
  suspect_calibration(without, candidates);
  return calibration_wrong_ ? without : choice;
}

void FloorJudge::judge(const SE3& calibrated, double frame_pixels, FloorResult& result) {
  std::vector<FloorCandidate> candidates;
  for (const ExtractedPlane& p : result.planes) {
    candidates.push_back({p.plane_camera, static_cast<double>(p.pixels), p.area});
  }
  const FloorChoice choice = choose(calibrated, candidates, frame_pixels);
  result.status = choice.status;
  result.reason = choice.reason;
  result.dominant = choice.index;
  if (choice.status == FloorStatus::kFound) {
    const ExtractedPlane& floor = result.planes[static_cast<std::size_t>(choice.index)];
    result.floor_camera = floor.plane_camera;
    result.T_body_camera = leveled(calibrated, floor.plane_camera);
    last_leveled_ = result.T_body_camera;
    if (options_.self_calibrate) {
      tracker_.update(calibrated, floor.plane_camera, floor_covariance(floor));
    } else {
      tracker_.skip(calibrated);
    }
  } else {
    tracker_.skip(calibrated);
    result.T_body_camera = tracker_.estimate().T_body_camera;
  }
  result.mounting = tracker_.estimate();
  classify(result);
}

void FloorJudge::classify(FloorResult& result) const {
  const bool leveled_now = result.status == FloorStatus::kFound || tracker_.started();
  for (std::size_t k = 0; k < result.planes.size(); ++k) {
    ExtractedPlane& p = result.planes[k];
    p.plane_body = result.T_body_camera * p.plane_camera;
    p.slope = std::atan2(p.plane_body.normal().head<2>().norm(), p.plane_body.normal().z());
    p.height = (result.T_body_camera * p.centroid_camera).z();
    if (static_cast<int>(k) == result.dominant) {
      p.kind = PlaneKind::kDominantFloor;
    } else if (!leveled_now) {
      p.kind = PlaneKind::kUnknown;
    } else if (p.slope <= options_.traversable_slope_deg * kDegree &&
               p.height <= options_.max_level_m) {
      p.kind = PlaneKind::kSubDominant;
    } else {
      p.kind = PlaneKind::kObstacle;
    }
  }
}

}  // namespace lamina
