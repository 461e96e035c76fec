// `ros2:` as a recording.
#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/bag_recording.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/ros2/live_source.hpp>

#include <cstdlib>

namespace lamina::ros2 {
int live_domain(const std::string& input) {
  const std::string text = input.substr(input.find(':') + 1);
  if (text.empty()) return dds::domain_of_environment();
  char* end = nullptr;
  const long domain = std::strtol(text.c_str(), &end, 10);
  if (*end != '\0' || domain < 0 || domain > dds::kLastDomain)
    throw input_error(input, "", "'" + text + "' as domain",
                      "ros2: or ros2:DOMAIN with 0 to " + std::to_string(dds::kLastDomain));
  return static_cast<int>(domain);
}

std::unique_ptr<Recording> open_live(const std::string& input, const RecordingOptions& options,
                                     const LiveOptions& live) {
  const int domain = live_domain(input);
  auto wire = dds::open_wire(domain);
  const char* stated = std::getenv("CYCLONEDDS_URI");
  const bool loopback = stated == nullptr || *stated == '\0';
  live.say("ros2: domain " + std::to_string(domain) +
           (loopback ? ", on this machine alone (CYCLONEDDS_URI is not set)" : "") +
           ": waits for scans, depth images or clouds");
  auto source = make_live_source(std::move(wire), live);
  if (live.ended()) throw std::runtime_error(input + ": interrupted before there was a map");
  bag::LiveSource* raw = source.get();
  auto recording = std::make_unique<BagRecording>(input, std::move(source), options, raw);
  live.on_frames(recording->odometry_frame(), recording->body_frame());
  return recording;
}

}  // namespace lamina::ros2

namespace lamina {

std::unique_ptr<Recording> open_ros2_live(const std::string& input,
                                          const RecordingOptions& options) {
  return ros2::open_live(input, options, {});
}

}  // namespace lamina
