// Whether a depth camera on wheels is still where these say, or was carried away unseen.
#pragma once

#include <cstddef>
#include <optional>

#include <lamina/frontend/motion/depth_blocks.hpp>
#include <lamina/models/lie/se3.hpp>

namespace lamina {

/// What two images say of each other's upright surfaces (walls, furniture; any floor is like any
/// other), in blocks that both could see.
struct PlaceLikeness {
  int like = 0;  ///< stand where the other image measured a surface, too
  int come =
      0;  ///< of the later image: stand where the earlier one saw through (moving_blocks.hpp)
  int gone = 0;  ///< of the earlier: stand where the later sees through
  int observed() const { return like + come + gone; }
};

/// `up_a`, `up_b`: the body's z in either camera's frame.
PlaceLikeness place_likeness(const DepthBlocks& a, const DepthBlocks& b, const SE3& T_a_b,
                             const Eigen::Vector3d& up_a, const Eigen::Vector3d& up_b);

/// Two images of one place, laid by wheels or by their fit, are alike. People come before a camera
/// and go, doors open; but then one of `come` and `gone` stays small, or most of the place is still
/// there, or what came moves on, or the old place comes back. A robot that was carried away, or
/// whose wheels slipped beyond what images are searched for, sees much that was not there and
/// through much that was, and from then on another place that stands still.
class PlaceWatch {
 public:
  /// The next image and the motion to it, as images tell it and as wheels do (body frame). Returns
  /// how many images ago the place became another one, once that is sure: after kSure images and
  /// kSureTime in which the new place stood still and nothing of the old one showed.
  std::optional<std::size_t> add(const DepthFrame& frame, const SE3& by_image,
                                 const SE3& by_wheels);

  static constexpr int kSure = 3;
  static constexpr double kSureTime = 0.4;  ///< s

 private:
  struct View {
    DepthBlocks blocks;
    SE3 T_body_camera;
    Timestamp stamp;
    SE3 moved_by_image, moved_by_wheels;  ///< body, from this view to the latest image
    void move(const SE3& by_image, const SE3& by_wheels);
  };
  static bool another_place(const View& before, const View& now);
  static bool same_place(const View& before, const View& now);

  std::optional<View> old_;  ///< the last one before what may be another place
  std::optional<View> new_;  ///< the first one there
  std::size_t since_ = 0;    ///< images since then
};

}  // namespace lamina
