// How a camera stands to a scanner, told by walls that both see at once.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include <lamina/frontend/segments/mounting_correction.hpp>
#include <lamina/models/block_evidence.hpp>
#include <lamina/models/observation.hpp>

namespace lamina {

/// Takes scans and images in the order of their stamps, pairs walls of an image with lines of the
/// last scan, and says how the camera must turn about the vertical and move level for both to lie
/// on one another: (heading, x, y), zero to 1.5 degrees and 2 cm, by
///   heading = angle(line) - angle(wall),  n.(q - p) = n.(heading z x (p - o) + t),
/// q on the line, p, n of the wall, o the camera. Roll, pitch and height the floor tells.
class SharedWalls {
 public:
  void add_scan(const Observations& scan, const SE3& T_start_body);
  void add_image(const Observations& image, const SE3& T_start_body);

  struct Result {
    MountingCorrection correction;
    Eigen::Vector3d sigma = Eigen::Vector3d::Zero();  ///< of heading (rad), x, y (m)
    int pairs = 0;
    Adoption adoption;            ///< by data left out
    bool is_significant = false;  ///< adopted, and more than one camera's images err by in common
  };
  /// nullopt for too few walls, or walls that do not agree.
  std::optional<Result> result() const;

 private:
  struct Pair {
    double angle, distance;  // rad, m
    double angle_sigma, distance_sigma;
    Eigen::Vector2d normal, offset;  // of the wall; its point from the camera, body frame
    Timestamp stamp;
  };
  struct Line;
  Adoption adoption() const;
  static std::vector<Line> lines_in(const Observations& scan, const SE3& T_image_scan);
  static std::optional<Pair> nearest_line(const Observations& image, const PlaneObservation& o,
                                          const std::vector<Line>& lines);

  std::optional<Observations> scan_;
  SE3 T_start_scan_body_;
  std::optional<SE3> T_start_last_;  // where an image was last counted as another view
  int views_ = 0;
  std::vector<Pair> pairs_;
};

}  // namespace lamina
