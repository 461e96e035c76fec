// SQLite recordings: SQLite itself reads them; what it gives is read to its end.
#include <lamina/sensors/ros2/db3_storage.hpp>

#include "fuzz/recording_file.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lamina::fuzz::read_recording(
      data, size, [](const std::string& file) { return lamina::ros2::open_db3(file, "x.db3"); });
  return 0;
}
