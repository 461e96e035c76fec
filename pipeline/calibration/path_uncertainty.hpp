// How far a path may be off where wheels alone told it.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>

#include <lamina/frontend/frontend.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

/// Follows what wheels that are wrong do to the path over the steps that were left to them
/// (Step::left_to_wheels). They err alike in every step by scale, drift and turn scale
/// (WheelErrors), and by their stated noise, a random walk. Headings off by it are taken to be
/// found again once what was seen told the heading over a metre in a row; places off stay off:
/// planes and loops met again, which may correct them, are left aside, for with wheels this wrong
/// these are easily taken for others. Where scans found out that wheels slipped, as large a share
/// of the way as they were wrong by there is taken to be wrong where only wheels tell it.
class WheelPath {
 public:
  void add(const Step& step);  ///< the first one's motion is the first pose
  /// A map told the wheels' errors so well: sigmas given later are no larger.
  void know(const Eigen::Vector3d& sigmas) { known_ = sigmas; }
  /// By counts of metrics.json, where wheels slipped or told anything alone; a large slip by a line
  /// of the log.
  void tell(const Eigen::Vector3d& sigmas, Diagnostics& metrics) const;
  double way() const { return way_; }          ///< m that only wheels told the length of
  double heading() const { return heading_; }  ///< m over which only wheels told the heading
  double alone() const { return alone_; }      ///< m of either
  double slipped() const { return slipped_; }  ///< m that wheels slipped by, as scans found out
  /// A stretch in which nothing but wheels told how far the robot went, up to a metre of what was
  /// seen in between: a slip there contradicts nothing.
  struct Stretch {
    double way = 0;      ///< m of it that wheels told
    Timestamp from, to;  ///< stamps of the steps it begins after and ends with
  };
  const Stretch& longest() const { return longest_; }
  /// m, 1-sigma: root mean square over the path's length of how far places are off in the map, by
  /// wheels with lawful errors of `sigmas` (scale, drift in rad/m, turn scale).
  double sigma(const Eigen::Vector3d& sigmas) const;

 private:
  // Of a step of `moved` m since the one at `before`.
  void note_stretch(const Step& step, double moved, Timestamp before);

  using ByErrors = Eigen::Matrix<double, 6, 3>;
  Eigen::Vector3d known_ = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  ByErrors off_ = ByErrors::Zero();                    // the pose's right tangent by the errors
  Matrix6d noise_ = Matrix6d::Zero();                  // its covariance by the stated noise
  Eigen::Matrix3d sum_off_ = Eigen::Matrix3d::Zero();  // of J^T J times metres, J: place by errors
  double sum_noise_ = 0, path_ = 0;                    // m^3, m
  double way_ = 0, heading_ = 0, alone_ = 0, slipped_ = 0;
  double held_ = 0;                // m since wheels last told a heading
  Stretch stretch_, longest_;      // the former: up to the last step, or until a metre ago
  double seen_ = 0;                // m since wheels last told the way
  std::optional<Timestamp> last_;  // of the step before
};

}  // namespace lamina
