// What is said of a camera whose floor does not lie where its mounting says.
#include <fmt/format.h>

#include <cmath>

#include <lamina/pipeline/calibration/camera/camera_checks.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

// What a cause says to people.
std::string cause_text(const MountingHypothesis& h, const CameraModel& stated) {
  const double height = stated.T_body_camera.translation().z();
  if (h.id == "camera_upside_down") return "the camera is upside down (180 deg about its axis)";
  if (h.id == "camera_sideways") return "the camera lies on its side (90 deg about its axis)";
  if (h.id == "camera_optical_rotation")
    return "the optical rotation (x right, y down, z ahead) is missing: looking straight ahead it "
           "is rotation_xyzw: [-0.5, 0.5, -0.5, 0.5]";
  if (h.id == "quaternion_order") return "rotation_xyzw of T_body_camera is written w, x, y, z";
  if (h.id == "camera_mirrored") return "images are mirrored left to right";
  if (h.id == "camera_heading")
    return fmt::format("the camera is turned by {:+.0f} deg of heading against T_body_camera",
                       h.ratio / kDegree);
  if (h.id == "focal_length")
    return fmt::format(
        "the focal length is {:.1f} px where fx says {:.1f} (x {:.3g}: that of images of another "
        "size?)",
        h.ratio * stated.fx, stated.fx, h.ratio);
  if (h.id == "depth_scale")
    return fmt::format("depths are {:.4g} times what depth_scale makes of them", h.ratio);
  if (h.id == "baseline")
    return fmt::format("the baseline is {:.3g} times the stated one", h.ratio);
  if (h.id == "camera_height")
    return fmt::format("the camera is {:.2f} m high, not {:.2f} m", h.ratio * height, height);
  if (h.id == "camera_tilt")
    return fmt::format("the camera is tilted by {:.1f} deg against its mounting", h.tilt / kDegree);
  return fmt::format("the camera is {:.2f} m high, not {:.2f} m, and tilted by {:.1f} deg",
                     h.ratio * height, height, h.tilt / kDegree);
}

std::string seen_text(const MountingVerdict& verdict, const CameraModel& stated) {
  return fmt::format("{} of {} images show the floor where T_body_camera says ({:.2f} m below)",
                     verdict.stated.floors, verdict.images, stated.T_body_camera.translation().z());
}

}  // namespace

Warning mounting_warning(const MountingVerdict& verdict, const CameraModel& stated,
                         bool corrected) {
  if (verdict.best.by_motion) {
    return {verdict.best.id,
            fmt::format("walls move as wheels say only if {}{}", cause_text(verdict.best, stated),
                        corrected ? ": corrected" : ": the map is of little use")};
  }
  if (verdict.wrong) {
    std::string text = fmt::format("{}, {} do if {}", seen_text(verdict, stated),
                                   verdict.best.floors, cause_text(verdict.best, stated));
    if (verdict.rival) text += fmt::format(" (or {})", cause_text(*verdict.rival, stated));
    return {verdict.best.id, text + (corrected ? ": corrected" : ": the map is of little use")};
  }
  return {};
}

Warning floor_unseen_warning(const MountingVerdict& verdict, const CameraModel& stated) {
  return {"camera_floor_unseen", seen_text(verdict, stated) +
                                     ": no ground is free by this camera; is its mounting right?"};
}

Warning floor_scatter_warning(const MountingVerdict& verdict, bool levelled) {
  constexpr double kStretch = 0.02, kPitching = 0.8 * kDegree;
  const double percent = 100 * verdict.height_scatter, tilt = verdict.tilt_scatter / kDegree;
  const bool stretched = verdict.height_scatter > kStretch,
             tilts = verdict.tilt_scatter > kPitching;
  if (stretched && tilts)
    return {
        "floor_uneven",
        fmt::format("the floor that images show lies nearer and further by {:.1f} % and tilts by "
                    "{:.1f} deg (1-sigma) from one to the next: it swells, and the body with "
                    "it, which the odometry does not say; walls may lean as much",
                    percent, tilt)};
  if (stretched)
    return {
        "depth_stretched",
        fmt::format("depths are stretched from image to image: the floor lies nearer and further "
                    "by {:.1f} % (1-sigma) though the camera's height stays; walls stand as far "
                    "off",
                    percent)};
  if (tilts && levelled)
    return {"body_pitch",
            fmt::format("the body pitches or rolls by {:.1f} deg (1-sigma, by the floors seen) and "
                        "the odometry, stated planar, does not say so: each image is levelled by "
                        "its own floor, walls and scans may lean as much",
                        tilt)};
  return {};
}

}  // namespace lamina
