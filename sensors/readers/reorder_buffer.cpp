// Reorders by time.
#include <lamina/sensors/readers/reorder_buffer.hpp>

#include <algorithm>

namespace lamina {
namespace {
// Of measurements of one time: as dataset folders have them, whatever order a file has.
int rank(const Measurement& m) {
  if (std::holds_alternative<Accelerometer>(m)) return 0;
  if (std::holds_alternative<Odometry>(m)) return 1;
  return std::holds_alternative<LaserScan>(m) ? 2 : 3;
}
bool comes_before(const Measurement& a, const Measurement& b) {
  const Timestamp ta = stamp_of(a), tb = stamp_of(b);
  return ta != tb ? ta < tb : rank(a) < rank(b);
}
}  // namespace

bool ReorderBuffer::push(Measurement measurement) {
  const Timestamp stamp = stamp_of(measurement);
  if (given_ && stamp < *given_) return false;
  newest_ = newest_ ? std::max(*newest_, stamp) : stamp;
  const auto place = std::upper_bound(held_.begin(), held_.end(), measurement, comes_before);
  held_.insert(place, std::move(measurement));
  return true;
}

std::optional<Measurement> ReorderBuffer::pop() {
  if (held_.empty()) return std::nullopt;
  const bool safe =
      finished_ || held_.size() >= capacity_ || *newest_ - stamp_of(held_.front()) > horizon_;
  if (!safe) return std::nullopt;
  Measurement result = std::move(held_.front());
  held_.pop_front();
  given_ = stamp_of(result);
  return result;
}

}  // namespace lamina
