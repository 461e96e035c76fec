// Image lists, odometry, accelerometer and TUM trajectories; the first byte chooses.
#include <lamina/models/error.hpp>
#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/readers/text_streams.hpp>

#include <sstream>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  if (size == 0) return 0;
  const std::string_view text = lamina::fuzz::text_of(data + 1, size - 1);
  lamina::SkipCounts skips;
  switch (data[0] % 4) {
    case 0:
      for (const auto& entry : lamina::parse_list(text, skips)) demand(!entry.path.empty());
      break;
    case 1: {
      const lamina::OdometryTrack track(lamina::parse_odometry(text, skips));
      for (const auto& pose : track.trajectory()) demand(track.at(pose.stamp).has_value());
      break;
    }
    case 2:
      for (const auto& a : lamina::parse_accelerometer(text, skips)) {
        demand(a.acceleration_body.allFinite());
      }
      break;
    default:
      try {
        std::istringstream in{std::string(text)};
        for (const auto& pose : lamina::Trajectory::read_tum(in, "t.txt")) {
          demand(pose.pose.matrix().allFinite());
        }
      } catch (const lamina::Error&) {
      }
  }
  return 0;
}
