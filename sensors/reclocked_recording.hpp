// A recording whose sensors' clocks were off, as if they had been right.
#pragma once

#include <deque>
#include <memory>

#include <lamina/sensors/forwarding_recording.hpp>

namespace lamina {

/// What is to be added to stamps (s) for the instants by one clock.
struct ClockOffsets {
  double scanner = 0;  ///< of scans
  double camera = 0;   ///< of depth images, stereo pairs and clouds
  double odometry = 0;
  bool any() const { return scanner != 0 || camera != 0 || odometry != 0; }
};

/// The source's measurements with corrected stamps, in their new order. Before a measurement whose
/// stamp was moved against the odometry's comes the odometry at that stamp, interpolated, as
/// readers give it: not in a hole (is_hole), nor beyond its end; up to a quarter of a second before
/// its beginning the first motion is carried back.
class ReclockedRecording final : public ForwardingRecording {
 public:
  ReclockedRecording(std::unique_ptr<Recording> source, const ClockOffsets& offsets);

  std::optional<Measurement> next() override;
  std::optional<DepthFrame> next_depth(std::int64_t skip) override;
  std::optional<Measurement> next_light() override;

 private:
  double offset_of(const Measurement& measurement) const;
  bool moved_against_odometry(const Measurement& measurement) const;
  void hold(Measurement measurement);
  bool may_give() const;
  /// The odometry at the stamp of the first that is held, which was moved there.
  std::optional<Odometry> met() const;
  template <class Read>
  std::optional<Measurement> next_by(const Read& read);

  ClockOffsets offsets_;
  std::deque<Measurement> held_;     // in order of their new stamps
  std::optional<Timestamp> newest_;  // as stamped by the source
  std::optional<Odometry> last_odometry_;
  bool ended_ = false;
};

/// `source` itself where no clock is off.
std::unique_ptr<Recording> reclocked(std::unique_ptr<Recording> source,
                                     const ClockOffsets& offsets);

}  // namespace lamina
