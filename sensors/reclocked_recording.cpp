// Holds measurements back until none that is older can come.
#include <lamina/sensors/reclocked_recording.hpp>

#include <algorithm>
#include <utility>

#include <lamina/sensors/odometry_track.hpp>

namespace lamina {
namespace {

constexpr double kWait = 0.5;      // s, for odometry after a measurement
constexpr double kCarried = 0.25;  // s, before the first odometry

bool is_odometry(const Measurement& m) { return std::holds_alternative<Odometry>(m); }

bool comes_before(const Measurement& a, const Measurement& b) {
  const Timestamp ta = stamp_of(a), tb = stamp_of(b);
  return ta != tb ? ta < tb : is_odometry(a) && !is_odometry(b);
}

}  // namespace

ReclockedRecording::ReclockedRecording(std::unique_ptr<Recording> source,
                                       const ClockOffsets& offsets)
    : ForwardingRecording(std::move(source)), offsets_(offsets) {}

double ReclockedRecording::offset_of(const Measurement& m) const {
  if (std::holds_alternative<LaserScan>(m)) return offsets_.scanner;
  if (is_odometry(m)) return offsets_.odometry;
  return std::holds_alternative<Accelerometer>(m) ? 0 : offsets_.camera;
}

bool ReclockedRecording::moved_against_odometry(const Measurement& m) const {
  return !std::holds_alternative<Accelerometer>(m) && offset_of(m) != offsets_.odometry;
}

void ReclockedRecording::hold(Measurement measurement) {
  const Timestamp stamp = stamp_of(measurement);
  newest_ = newest_ ? std::max(*newest_, stamp) : stamp;
  const double offset = offset_of(measurement);
  std::visit([offset](auto& m) { m.stamp = m.stamp + offset; }, measurement);
  held_.insert(std::upper_bound(held_.begin(), held_.end(), measurement, comes_before),
               std::move(measurement));
}

// Nothing that comes may be older than the first held, and odometry that tells of it is there.
bool ReclockedRecording::may_give() const {
  if (held_.empty()) return false;
  if (ended_) return true;
  const Timestamp stamp = stamp_of(held_.front());
  if (!(stamp <= *newest_ + std::min({0.0, offsets_.scanner, offsets_.camera, offsets_.odometry})))
    return false;
  return !moved_against_odometry(held_.front()) || *newest_ - stamp > kWait ||
         std::count_if(held_.begin(), held_.end(), is_odometry) >= (last_odometry_ ? 1 : 2);
}

std::optional<Odometry> ReclockedRecording::met() const {
  if (!moved_against_odometry(held_.front())) return std::nullopt;
  const Timestamp stamp = stamp_of(held_.front());
  const auto after = std::find_if(held_.begin(), held_.end(), is_odometry);
  if (after == held_.end()) return std::nullopt;
  const auto& next = std::get<Odometry>(*after);
  if (!last_odometry_) {  // moved before the first: the motion there is carried back
    const auto second = std::find_if(after + 1, held_.end(), is_odometry);
    if (second == held_.end() || next.stamp - stamp > kCarried) return std::nullopt;
    const auto& inner = std::get<Odometry>(*second);
    const double share = (inner.stamp - stamp) / (inner.stamp - next.stamp);
    return Odometry{stamp, SE3::interpolate(inner.T_odom_body, next.T_odom_body, share), true};
  }
  const SE3& T_last = last_odometry_->T_odom_body;
  const double dt = next.stamp - last_odometry_->stamp;
  if (!(last_odometry_->stamp < stamp && stamp < next.stamp)) return std::nullopt;
  if (is_hole(T_last, next.T_odom_body, dt)) return std::nullopt;
  const double share = (stamp - last_odometry_->stamp) / dt;
  return Odometry{stamp, SE3::interpolate(T_last, next.T_odom_body, share), true};
}

template <class Read>
std::optional<Measurement> ReclockedRecording::next_by(const Read& read) {
  while (!may_give()) {
    if (ended_) return std::nullopt;
    if (auto measurement = read()) {
      hold(std::move(*measurement));
    } else {
      ended_ = true;
    }
  }
  if (auto odometry = met()) {
    last_odometry_ = odometry;
    return Measurement(*odometry);
  }
  Measurement first = std::move(held_.front());
  held_.pop_front();
  if (is_odometry(first)) last_odometry_ = std::get<Odometry>(first);
  return first;
}

std::optional<Measurement> ReclockedRecording::next() {
  return next_by([this] { return source().next(); });
}

std::optional<Measurement> ReclockedRecording::next_light() {
  return next_by([this] { return source().next_light(); });
}

std::optional<DepthFrame> ReclockedRecording::next_depth(std::int64_t skip) {
  auto frame = source().next_depth(skip);
  if (frame) frame->stamp = frame->stamp + offsets_.camera;
  return frame;
}

std::unique_ptr<Recording> reclocked(std::unique_ptr<Recording> source,
                                     const ClockOffsets& offsets) {
  if (!offsets.any()) return source;
  return std::make_unique<ReclockedRecording>(std::move(source), offsets);
}

}  // namespace lamina
