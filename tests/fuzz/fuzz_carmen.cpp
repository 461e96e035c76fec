// CARMEN logs: whatever is read comes in time order and is finite.
#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  try {
    const auto recording =
        lamina::open_carmen_text(std::string(lamina::fuzz::text_of(data, size)), "a.log", {});
    std::optional<lamina::Timestamp> last;
    while (const auto m = recording->next()) {
      demand(!last || *last <= stamp_of(*m));
      last = stamp_of(*m);
      if (const auto* scan = std::get_if<lamina::LaserScan>(&*m)) {
        demand(scan->size() >= 2 && scan->angle_increment != 0);
        demand(scan->lidar.T_body_lidar.matrix().allFinite());
      }
      if (const auto* odometry = std::get_if<lamina::Odometry>(&*m)) {
        demand(odometry->T_odom_body.matrix().allFinite());
      }
    }
  } catch (const lamina::Error&) {
  }
  return 0;
}
