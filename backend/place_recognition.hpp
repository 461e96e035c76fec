// Planes met again after the window forgot them: geometric loop closure, verified against several
// planes at once before it is believed.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lamina/backend/graph.hpp>

namespace lamina {

struct PlaceRecognitionOptions {
  bool enabled = true;
  /// Pairs of a new and an old plane that must agree on one correction of the pose.
  int min_planes = 4;
  double gate_chi_squared = 16.3;  ///< of each pair after the common correction, 3 degrees, 99.9 %
  double max_translation_m = 5;    ///< corrections beyond this are never believed
  double max_rotation_deg = 20;
  /// The next best set of pairs must explain at most this share of the best one's pairs, if it
  /// wants another correction: rooms look alike.
  double max_rival_share = 0.7;
  int every_keyframes = 3;  ///< how often it is tried

  std::vector<std::string> problems() const;
};

}  // namespace lamina
