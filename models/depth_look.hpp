// How far the lines of sight of one depth image got: what it says of what does not stand there.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace lamina {

/// s between looks worth keeping: people hardly move on meanwhile.
constexpr double kLookInterval = 0.19;

/// What an image says of a place.
enum class Sight {
  kUnknown,  ///< outside it, hidden, or too few returns around
  kMet,      ///< something was seen there
  kPast,     ///< all lines of sight around the place went on behind it
};

/// A depth image in squares of pixels: of each the least depth that any of its pixels measured.
/// Squares (i, j) of (u, v), i running fastest; square coordinates of a point (x, y, z) of the
/// camera frame are fx x / z + cx and fy y / z + cy, square (i, j) holds [i, i + 1) x [j, j + 1).
struct DepthLook {
  float fx = 1, fy = 1, cx = 0, cy = 0;  ///< squares
  float pixel = 0;                       ///< what one pixel spans, m per m of depth
  float noise = 0;                       ///< sigma of the depth Z: noise Z^2 (m, noise in 1/m)
  std::int32_t nx = 0, ny = 0;
  std::vector<std::uint8_t> reach;  ///< coded least depth; 0: too many pixels without a return

  bool empty() const { return reach.empty(); }
  /// Depth of codes in steps of 2 %, rounded down; 0 for what is nearer than kNearest m.
  static constexpr double kNearest = 0.25;
  static std::uint8_t code(double depth_m);
  static double depth(std::uint8_t code);

  /// How far behind a place at depth z (m) all lines of sight must have gone: 5 cm for errors of
  /// poses, 2 % for the code, 4 sigma.
  double margin(double z) const { return 0.05 + 0.02 * z + 4 * static_cast<double>(noise) * z * z; }
  /// Of the squares that hold anything within `radius` (m) of a point in the camera frame.
  Sight at(const Eigen::Vector3d& p_camera, double radius) const;
};

}  // namespace lamina
