// Floor seen against mounting stated: what a camera's calibration is likely wrong by.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lamina/frontend/depth/floor_result.hpp>
#include <lamina/frontend/depth/leveling.hpp>
#include <lamina/models/adoption.hpp>
#include <lamina/models/plane.hpp>
#include <lamina/sensors/camera_correction.hpp>
#include <lamina/sensors/measurement.hpp>

namespace lamina {

/// Numbers of the check, each moved by a half in its test.
struct MountingCheckOptions {
  double sigma_tilt = 0.05;       ///< rad: how far a mounting by tape measure is off
  double sigma_hand = 0.3;        ///< rad: how far a camera held in a hand is tilted
  double sigma_height = 0.04;     ///< of the height: likewise
  double sigma_height_m = 0.015;  ///< m: likewise
  double sigma_wall_tilt = 0.05;  ///< rad: a wall seen again after a motion by wheels
  double sigma_wall = 0.03;       ///< m and share of its distance: likewise
  double truncate = 16.27;        ///< chi-squared of 3, .999: what an image without a fit costs
  double fits = 6.25;             ///< of misfit: a floor within 2.5 sigmas lies as a cause says
  double wins_by = 50;            ///< of cost, over the calibration as stated
  double clear_by = 8;            ///< of cost, over any other cause
  double price_known = 4;         ///< of a cause that has no number, or a usual one (1000 for 5000)
  double price_free = 7;          ///< of each number that is fitted beyond that
  std::size_t least_images = 8;   ///< in which the floor must lie as a cause says
  double least_share = 0.25;      ///< of the images: likewise
  double most_tilt = 0.9;         ///< rad: a camera is not tilted further than this by mistake
  double most_offset = 0.16;      ///< 1/m: 5 px of a stereo pair of 250 px and 0.12 m
  int steps = 40;                 ///< tried on either side of none
  double least_plane_share = 0.015;  ///< of an image's pixels: smaller planes are no floor or wall
};

/// One image, as its stated calibration has it.
struct MountingView {
  struct Seen {
    Plane plane_camera;  ///< normal towards the camera
    double share = 0;    ///< of the image's pixels
  };
  std::vector<Seen> planes;
  std::optional<SE3> T_odom_body;  ///< by wheels, where they tell it
};

/// One row of the table: a cause, what it explains, what cures it.
struct MountingHypothesis {
  std::string id;  ///< empty: as stated; else the cause, such as "depth_scale" (docs/formats.md)
  CameraCorrection correction;
  double ratio = 1;        ///< of focal length, depth or height: true over stated
  double tilt = 0;         ///< rad, by which the mounting is turned
  bool by_motion = false;  ///< floors lie alike; what is seen moves as wheels say only so
  bool loose = false;      ///< the body itself tilts: floors lie as a hand holds the camera
  double price = 0;        ///< of the numbers that it needs
  double cost = 0;         ///< price, floors and walls together
  std::size_t floors = 0;  ///< images whose floor lies as it says
};

/// Images of a whole recording in which a floor lies where the mounting says.
struct FloorsAsStated {
  std::int64_t images = 0, floors = 0;
  void add(const DepthFrame& frame, const FloorResult& floor);
  /// Fewer than one image in twenty.
  bool hardly_any() const { return 20 * floors < images; }

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, FloorsAsStated& v) {
    a(v.images, v.floors);
  }
};

/// A constant of all 1 / depths (of disparities), by walls that come nearer and go.
struct DepthOffset {
  double value = 0;    ///< 1/m: measured less true
  double gain = 0;     ///< of cost, against none
  Adoption adoption;   ///< by parts of the recording left out
  bool clear = false;  ///< no wheel scale and no other mounting explain nearly as much
};

/// What a look over some tens of images found.
struct MountingVerdict {
  std::size_t images = 0;  ///< with planes
  MountingHypothesis stated, best;
  bool wrong = false;  ///< `best` is to be believed, not `stated`
  /// A cause of another cure that explains nearly as much.
  std::optional<MountingHypothesis> rival;
  /// Hardly any image shows a floor where the mounting says; where it is not `wrong`, no cause
  /// explains why.
  bool never_seen = false;
  /// Scatter of the floors seen, 1-sigma: of their height (share of it), of their tilt (rad, about
  /// the axis of more). 0: no height was stated, or few floors were seen.
  double height_scatter = 0, tilt_scatter = 0;
};

/// The table of causes against some tens of images: as stated; upside down or on its side; without
/// the optical rotation; focal length, depth or height off by a factor; tilted. Each predicts where
/// the floor lies in every image and, where wheels tell the motion, where walls lie in the next.
/// Cost of a cause: truncated squares over all images and walls, and a price for what it fits.
class MountingCheck {
 public:
  /// `stereo`: depth follows from the focal length. A height below 0.1 m is none that was stated.
  MountingCheck(const SE3& T_body_camera, bool stereo, const MountingCheckOptions& options = {});
  void add(MountingView view);
  std::size_t images() const { return views_.size(); }
  /// One of the planes lies where the calibration as it is has the floor.
  bool shows_floor(const std::vector<MountingView::Seen>& planes) const;
  MountingVerdict verdict() const;
  /// The calibration as it is, alone.
  MountingHypothesis as_stated() const;
  /// Walls move as wheels say, and floors lie as stated, only with this offset; nullopt where too
  /// few walls are met again from elsewhere.
  std::optional<DepthOffset> depth_offset() const;
  /// The mounting, turned so that most floors are level; as it is where none is seen.
  SE3 levelled(const CameraCorrection& correction) const;

 private:
  struct Steady {
    Plane plane;
    std::size_t images = 0;
  };
  std::vector<Steady> steady_planes() const;
  void add_causes(const Plane& floor, std::vector<MountingHypothesis>& all) const;
  void add_focal(const Plane& floor, const SO3& R, std::vector<MountingHypothesis>& all) const;
  void add_tilted(const Plane& floor, std::vector<MountingHypothesis>& all) const;
  Plane corrected(const Plane& plane, const CameraCorrection& correction) const;
  double floor_misfit(const Plane& plane, const CameraCorrection& correction,
                      double sigma_tilt) const;
  double motion_cost(const CameraCorrection& correction) const;
  void score(MountingHypothesis& hypothesis) const;
  std::optional<MountingHypothesis> by_motion(const MountingHypothesis& base) const;
  std::vector<Leveling> floors_of(const CameraCorrection& correction) const;
  double meets_again(const CameraCorrection& correction, std::size_t from, std::size_t to,
                     const SE3& T_camera_to_from) const;
  void add_scatter(MountingVerdict& verdict) const;
  bool looks_up() const;
  SE3 mounted(const SO3& R, double height) const;

  SE3 T_body_camera_;
  bool stereo_, height_stated_;
  MountingCheckOptions options_;
  std::vector<MountingView> views_;
  std::size_t empty_ = 0;  // views without planes
};

}  // namespace lamina
