// Headers of .pcd files: what passes never claims more than the file can hold.
#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/pcd_header.hpp>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  const std::string_view bytes = lamina::fuzz::text_of(data, size);
  try {
    const lamina::PcdHeader header = lamina::check_pcd(bytes, "c.pcd");
    demand(header.has_xyz && header.points > 0 && header.data_begin <= size);
    if (header.data == "binary") {
      demand(header.points * header.point_bytes <= static_cast<std::int64_t>(size));
    }
  } catch (const lamina::Error&) {
  }
  return 0;
}
