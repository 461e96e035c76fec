// What wheels say of the way, less what is known to be wrong with them.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include <lamina/frontend/motion/wheel_bias_filter.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>

namespace lamina {

/// Wheel odometry (or any other that is chained) as motions between steps: across holes of it,
/// and less the systematic errors that were learned.
class WheelMotion {
 public:
  /// `learn` false: systematic errors are never taken out.
  WheelMotion(const OdometryModel& model, bool learn)
      : planar_(model.planar), track_(model), whole_(model), errors_(learn) {}

  /// What is known of the scale; before the first measurement.
  void begin(double scale, double sigma) { errors_.begin(scale, sigma); }
  /// As if there were none; before the first measurement.
  void leave() { left_out_ = true; }
  /// The odometry of the whole recording, for velocities alone; before the first scan.
  void use_whole(WheelTrack whole) { whole_ = std::move(whole); }
  const WheelTrack& whole() const { return whole_; }

  void add(const Odometry& odometry) {
    if (!left_out_) track_.add(odometry);
  }
  /// A step at `stamp`: those to come ask back to `from` at most.
  void meet(Timestamp stamp, std::optional<Timestamp> from);
  /// The step at `stamp` is placed; `increment` led to it.
  void placed(Timestamp stamp, const SE3& T_start_body, const Increment& increment);
  /// Compares the way by wheels up to `stamp`, as measured, with that by scans.
  void learn(Timestamp stamp, const std::optional<Increment>& by_wheels,
             const std::optional<SE3>& by_scans) {
    errors_.add(stamp, by_wheels, by_scans);
  }

  const WheelTrack& track() const { return track_; }
  /// Odometry told of the own time of a frame or scan; outside of that it is none.
  bool met() const { return met_; }
  /// There was odometry, but never at the time of a scan or frame: it told nothing.
  bool never_met() const { return !track_.empty() && !met_; }
  /// There was odometry that stayed where it began.
  bool never_moved() const { return met_ && !track_.moved(); }
  /// It told of such times, and is that of wheels on a floor.
  bool met_on_floor() const { return met_ && planar_; }
  /// Mean velocity of the body over a scan or step, by the whole odometry where that is known.
  std::optional<Vector6d> velocity(Timestamp from, Timestamp to) const {
    return (whole_.empty() ? track_ : whole_).velocity(from, to);
  }
  /// A motion less its systematic errors, so far as they are learned and adopted.
  std::optional<Increment> corrected(const std::optional<Increment>& measured) const {
    return measured && planar_ ? errors_.corrected(*measured) : measured;
  }
  /// Counters go on across a hole: the way from T_start_from to `to`, by the last step that wheels
  /// told of, whatever was guessed since. nullopt where they told of the last step.
  std::optional<Increment> across_hole(const SE3& T_start_from, Timestamp to) const;
  /// Steps in the hole before now, and the covariance (right tangent) of the way guessed in it.
  std::int64_t steps_in_hole() const { return last_met_ ? last_met_->steps : 0; }
  Matrix6d guessed_in_hole() const { return last_met_ ? last_met_->since : Matrix6d::Zero(); }
  /// 1-sigma of what is left in corrected(): scale (1), drift (rad/m), turn scale (1).
  Eigen::Vector3d errors_left() const { return errors_.left(); }

  /// For archives (models/archive.hpp): all that one measurement leaves to the next.
  template <class A>
  friend void fields(A& a, WheelMotion& v) {
    auto& [planar, track, whole, errors, met, last_met, left_out] = v;
    static_cast<void>(planar);    // of the calibration
    static_cast<void>(whole);     // of the recording, before it is mapped
    static_cast<void>(left_out);  // likewise
    a(track, errors, met, last_met);
  }

 private:
  /// The last step of whose time wheels told, and the way since, of which they did not.
  struct LastMet {
    Timestamp stamp;
    SE3 T_start_body;
    Matrix6d since = Matrix6d::Zero();  // covariance, right tangent
    std::int64_t steps = 0;
    template <class A>
    friend void fields(A& a, LastMet& v) {
      a(v.stamp, v.T_start_body, v.since, v.steps);
    }
  };

  bool planar_;  // on a floor
  WheelTrack track_, whole_;
  WheelLearning errors_;
  bool met_ = false;
  std::optional<LastMet> last_met_;
  bool left_out_ = false;
};

}  // namespace lamina
