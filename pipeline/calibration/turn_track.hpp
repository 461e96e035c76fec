// The heading of a body on wheels over time.
#pragma once

#include <optional>
#include <vector>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

/// Yaw of the odometry, unwrapped and linear between samples.
class TurnTrack {
 public:
  /// Stamps must increase; others are left out.
  void add(Timestamp stamp, const SE3& T_odom_body);
  bool empty() const { return samples_.empty(); }
  /// rad from some start; nullopt beyond the samples and where the body turned in a silence of more
  /// than 0.3 s: nobody knows when.
  std::optional<double> at(Timestamp stamp) const;
  /// rad/s, the mean from one stamp to a later one.
  std::optional<double> rate(Timestamp from, Timestamp to) const;

 private:
  struct Sample {
    Timestamp stamp;
    double yaw;  // rad, unwrapped
  };
  std::vector<Sample> samples_;
};

}  // namespace lamina
