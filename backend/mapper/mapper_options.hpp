// Settings of the mapper, with units and reasons.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include <lamina/backend/association/association.hpp>
#include <lamina/backend/association/connected_ground.hpp>
#include <lamina/backend/association/place_recognition.hpp>
#include <lamina/backend/association/plane_evidence.hpp>
#include <lamina/backend/mapper/joint_surfels.hpp>
#include <lamina/backend/mapper/plane_labels.hpp>
#include <lamina/backend/solver/window/sliding_window.hpp>

namespace lamina {

struct MapperOptions {
  WindowOptions window;
  AssociationOptions association;
  PlaceRecognitionOptions place;

  // ---- keyframes: by motion and by new evidence
  double keyframe_distance_m = 0.4;  ///< odometry loses about a centimetre in that
  double keyframe_angle_deg = 15;    ///< a quarter of a depth camera's view
  /// A frame with this share of observations that match nothing known becomes a keyframe if it
  /// moved by a quarter of the above at least.
  double keyframe_new_share = 0.5;

  /// The window takes motions as this many times surer than their covariance says; the graph that
  /// is refined does not. Above 1 where they come from a path whose loops are closed already:
  /// smoothing then must not bend it apart again before the refiner sees it.
  double window_motion_trust = 1;
  /// Height, roll and pitch, too: not where loops say nothing of them.
  bool window_trusts_tilt = true;

  // ---- planes
  PartialView partial_view = PartialView::kMoments;  ///< what segments of scans say of planes
  /// Frames that must have seen a plane before it enters the map: one-off fits are mostly clutter.
  int min_observations = 3;
  /// Tentative planes not seen for so many keyframes are forgotten.
  int forget_keyframes = 10;
  /// Weak prior on the tilt of planes seen by segments alone (perpendicular to the scan, as in
  /// the article on planes from a 2D lidar), deg, and on the distance of any plane, m: holds what
  /// nothing measures.
  double prior_tilt_deg = 5;
  double prior_distance_m = 100;
  /// Directions whose 1-sigma after estimation is above this share of the prior's are reported as
  /// unobserved.
  double unobserved_share = 0.5;
  /// Planes of the map that turn out to be one are merged when they agree within the association's
  /// gates and their outlines are near.
  bool merge_planes = true;

  /// The first floor lies where Observations::first_floor_map says to within this much: keeps the
  /// map level where small errors of mounting would tilt it bit by bit.
  double first_floor_tilt_deg = 0.1;
  double first_floor_height_m = 0.005;

  // ---- outlines and surfels
  double outline_cell_m = 0.1;
  double surfel_cell_m = 0.1;
  double surfel_parent_sigma_m = 0.01;  ///< height off the parent plane, robust
  double surfel_parent_slope_deg = 3;
  ConnectedGroundOptions ground;     ///< pieces of it that are one floor
  JointSurfelOptions joint_surfels;  ///< of floors that are no planes

  LabelOptions labels;

  /// Keyframes seen from nowhere new (an older one within this, same planes) are taken out when
  /// they leave the window, so that laps of one building do not grow the graph. 0: never.
  double reuse_distance_m = 0.3;
  double reuse_angle_deg = 12;

  double prior_tilt() const { return prior_tilt_deg * (M_PI / 180.0); }  ///< rad

  std::vector<std::string> problems() const;
};

}  // namespace lamina
