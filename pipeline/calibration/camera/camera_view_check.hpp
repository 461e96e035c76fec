// Some tens of images of one camera from different places, and what they say of it together.
#pragma once

#include <optional>
#include <vector>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/depth/mounting_check.hpp>
#include <lamina/sensors/camera_corrected_recording.hpp>
#include <lamina/sensors/depth_codes.hpp>

namespace lamina {

/// The views of one camera.
class CameraLook {
 public:
  CameraLook(const FloorOptions& options, bool stereo);
  /// One more image came: is it a view, the robot moved since the last?
  bool wants(const std::optional<SE3>& T_odom_body);
  void add(const DepthFrame& frame, const std::optional<SE3>& T_odom_body);
  bool any() const { return !views_.empty(); }
  /// Enough was seen.
  bool done() const;
  /// Not so yet: as many views as are ever taken.
  void look_on() { looks_on_ = true; }
  /// Of images so corrected (all but the camera's model; where depths lie where no camera measures,
  /// by the usual factor, too).
  MountingVerdict verdict(const CameraFixes& fixes);
  /// Likewise: MountingCheck::depth_offset().
  std::optional<DepthOffset> offset(const CameraFixes& fixes);
  /// Likewise: robot_pixels(); empty where the floor is hardly seen.
  std::vector<bool> robot(const CameraFixes& fixes);
  /// The share of images that is in planes, by the last of these.
  double flatness() const;
  const DepthCodes& codes() const { return codes_; }
  const DepthCamera& camera() const { return views_.front().frame.camera; }

 private:
  struct View {
    DepthFrame frame;
    std::optional<SE3> T_odom_body;
  };
  void add_view(const View& view, double depth = 1);
  void look_again(const CameraFixes& fixes);

  FloorOptions options_;
  bool stereo_;
  std::vector<View> views_;
  FloorFrontend floor_{options_};
  std::optional<MountingCheck> check_;
  DepthCodes codes_;
  int since_ = 0;
  bool wheels_ = false, changed_ = false, looks_on_ = false;
  double turned_ = 0;  // rad, over all views
  double flat_ = 0;    // shares in planes, over all views
};

}  // namespace lamina
