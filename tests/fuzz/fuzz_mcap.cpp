// MCAP files, chunks of every compression: read to their end, within bounds.
#include <lamina/sensors/ros2/mcap_storage.hpp>

#include "fuzz/recording_file.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lamina::fuzz::read_recording(data, size, [](const std::string& file) {
    lamina::ros2::McapOptions options;
    options.most_unpacked = std::size_t{1} << 24;  // so that many runs fit into a minute
    return lamina::ros2::open_mcap(file, "x.mcap", options);
  });
  return 0;
}
