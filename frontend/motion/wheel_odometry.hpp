// Wheel odometry between the instants the mapper is told of.
#pragma once

#include <deque>
#include <optional>

#include <lamina/sensors/odometry.hpp>

namespace lamina {

/// What moved between two instants: T_from_to and the covariance of its right tangent
/// (translation, rotation).
struct Increment {
  SE3 T_from_to;
  Matrix6d covariance;
};

template <class A>
void fields(A& a, Increment& v) {
  a(v.T_from_to, v.covariance);
}

/// Keeps the odometry since the last step and interpolates it to any stamp inside. A path is summed
/// sample by sample, so that turning in place and driving back count as travel.
class WheelTrack {
 public:
  explicit WheelTrack(const OdometryModel& model) : model_(model) {}
  void add(const Odometry& odometry);
  bool empty() const { return samples_.empty(); }
  /// Two samples differed: an odometry that has not moved yet may be one that was never connected.
  bool moved() const { return moved_; }
  /// The stamp of the newest sample; only when not empty.
  Timestamp newest() const { return samples_.back().stamp; }
  /// T_odom_body of the oldest sample; only when not empty.
  const SE3& oldest() const { return samples_.front().T_odom_body; }
  /// The motion from one stamp to a later one, both at(). nullopt, too, for leaps that no robot
  /// makes (50 m and 50 m/s).
  std::optional<Increment> between(Timestamp from, Timestamp to) const;
  /// The mean velocity of the body (right tangent, m/s and rad/s) from one stamp to a later one, or
  /// over as long a time that ends with the newest sample; nullopt without samples for it.
  std::optional<Vector6d> velocity(Timestamp from, Timestamp to) const;
  /// Several samples lie between these stamps.
  bool several_within(Timestamp from, Timestamp to) const;
  /// Forgets samples that no later question from `stamp` on needs.
  void forget_before(Timestamp stamp);
  /// T_odom_body at a stamp. A body that stood still over the two samples at an end is taken to
  /// stand for kMaxGap beyond it. nullopt further out, beside an end at which it drove, and in a
  /// hole: more than a second and four usual intervals between two samples that are 5 cm or 3
  /// degrees apart.
  std::optional<SE3> at(Timestamp stamp) const;

  static constexpr double kMaxGap = 0.5;  ///< s

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, WheelTrack& v) {
    a(v.samples_, v.moved_, v.usual_);
  }

 private:
  bool hole(const Odometry& before, const Odometry& after) const;
  std::deque<Odometry>::const_iterator first_after(Timestamp stamp) const;
  bool restarted_within(Timestamp from, Timestamp to) const;

  OdometryModel model_;
  std::deque<Odometry> samples_;
  bool moved_ = false;
  double usual_ = 0;  ///< s between samples; 0: not known yet
};

}  // namespace lamina
