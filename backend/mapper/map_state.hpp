// A map at rest: all that is kept of a mapper once nothing is in motion. What sessions store.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/mapper/frame_log.hpp>
#include <lamina/backend/mapper/surfel_estimator.hpp>

namespace lamina {

struct MapState {
  Graph graph;
  std::vector<MapFrame> frames;           ///< in the order they were processed
  std::map<KeyframeId, SE3> left_window;  ///< T_map_body as each keyframe left the window
  std::map<PlaneId, std::vector<OutlinePiece>> outlines;
  std::set<PlaneId> partial;  ///< seen by segments alone
  SurfelEvidence surfels;
  std::map<KeyframeId, std::vector<Eigen::Vector3d>> loose_body;
  Eigen::Matrix3d extrinsics_covariance =
      Eigen::Matrix3d::Zero();  ///< Mapper::set_extrinsics_covariance()
  Eigen::Matrix3d wheel_covariance = Eigen::Matrix3d::Zero();  ///< Mapper::set_wheel_covariance()

  /// One line for every broken reference; empty: sound.
  std::vector<std::string> problems() const;
};

/// Another map b seen from a map a: where it lies, and which of its planes are planes of a.
struct MapOverlap {
  SE3 T_a_b;
  std::vector<std::pair<PlaneId, PlaneId>> planes;  ///< (of b, of a)
  /// Level planes are among them. Else nothing tells b's height and tilt from a's but that both
  /// stand on one floor: append() holds b's first keyframe to 3 cm and half a degree.
  bool level = true;
};

/// Adds map b to map a, moved to where it lies; planes of b that are planes of a are merged into
/// them, all other ids of b are raised to be new. b's datum goes: a's holds both, with its doubts
/// of mountings and wheels. Custom factors of b stay behind: they say where its own map is. Stamps
/// stay. Refine afterwards: shared planes tie the two together, and
/// nothing else does.
void append(MapState& a, const MapState& b, const MapOverlap& overlap);

}  // namespace lamina
