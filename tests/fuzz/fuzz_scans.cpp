// scans.csv: lines that read have beams, and used stamps increase.
#include <lamina/sensors/readers/text_streams.hpp>
#include <lamina/sensors/scan_stream.hpp>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  lamina::SkipCounts skips;
  std::size_t scans = 0;
  lamina::ScanStream stream;
  for (const lamina::ScanLine& line :
       lamina::index_scans(lamina::fuzz::text_of(data, size), skips)) {
    std::string why;
    const auto scan = lamina::parse_scan_line(line.line, why);
    demand(scan ? scan->size() >= 2 && scan->stamp == line.stamp : !why.empty());
    if (scan) stream.add(scan->stamp, scan->ranges, scan->range_min, scan->range_max);
    scans += scan ? 1 : 0;
  }
  stream.finish([](std::size_t k) { return std::to_string(k); });
  std::optional<lamina::Timestamp> last;
  for (std::size_t k = 0; k < scans; ++k) {
    const auto stamp = stream.stamp(k);
    demand(!stamp || !last || *last < *stamp);
    if (stamp) last = stamp;
  }
  return 0;
}
