// Planes met again after the window forgot them: geometric loop closure, verified against several
// planes at once before it is believed.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lamina/backend/association/plane_index.hpp>
#include <lamina/backend/graph/graph.hpp>

namespace lamina {

struct PlaceRecognitionOptions {
  bool enabled = true;
  /// Pairs of a new and an old plane that must agree on one correction of the pose.
  int min_planes = 4;
  double gate_chi_squared = 16.3;  ///< of each pair after the common correction, 3 degrees, 99.9 %
  /// What a map's own parts are wrong by among each other, 1-sigma, over the extent of one view.
  double local_sigma_m = 0.03;
  double local_sigma_deg = 1.0;
  /// The correction must be known better than this from the pairs alone, 1-sigma.
  double sure_m = 0.1;
  double sure_deg = 2;
  double max_translation_m = 5;  ///< corrections beyond this are never believed
  double max_rotation_deg = 20;
  /// The next best set of pairs must explain at most this share of the best one's pairs, if it
  /// wants another correction: rooms look alike.
  double max_rival_share = 0.7;
  int every_keyframes = 3;  ///< how often it is tried

  std::vector<std::string> problems() const;
};

/// A plane as place recognition sees it.
struct RecognitionPlane {
  PlaneId id = PlaneId::kNone;
  Plane plane_map;
  Eigen::Vector3d middle_map = Eigen::Vector3d::Zero();  ///< of what was seen, on the plane
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of plane_map.about(middle_map)
};

struct PlaceMatch {
  SE3 T_old_new;  ///< moves what was mapped just now onto what was mapped long ago
  std::vector<std::pair<PlaneId, PlaneId>> pairs;  ///< (new, old)
  double chi_squared = 0;                          ///< of all pairs, 3 degrees each
};

/// Looks for one small motion that lays planes seen now upon planes known from before. Every two
/// pairs with normals that differ propose a motion; the motion that most pairs agree with, outline
/// on outline, is believed when it has pairs enough, determines x, y and heading, and no other
/// motion explains nearly as much. `body_map`: where the robot is; rotations are about it.
/// `reach_m`: how far off the robot may be. Deterministic; nullopt: not recognised.
std::optional<PlaceMatch> recognise_place(std::span<const RecognitionPlane> fresh,
                                          std::span<const RecognitionPlane> old,
                                          const PlaneIndex& index, const Eigen::Vector3d& body_map,
                                          double reach_m, const PlaceRecognitionOptions& options);

}  // namespace lamina
