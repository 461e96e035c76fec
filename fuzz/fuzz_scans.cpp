// scans.csv: lines that read have beams, and stamps increase.
#include <lamina/sensors/text_streams.hpp>

#include "fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  lamina::SkipCounts skips;
  std::optional<lamina::Timestamp> last;
  for (const lamina::ScanLine& line :
       lamina::index_scans(lamina::fuzz::text_of(data, size), skips)) {
    demand(!last || *last < line.stamp);
    last = line.stamp;
    std::string why;
    const auto scan = lamina::parse_scan_line(line.line, why);
    demand(scan ? scan->size() >= 2 && scan->stamp == line.stamp : !why.empty());
  }
  return 0;
}
