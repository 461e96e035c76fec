// One scan a line.
#include <lamina/io/scan_files.hpp>

#include <cstdio>
#include <ostream>
#include <string>

namespace lamina::io {

void write_scan_header(std::ostream& out) {
  out << "# timestamp,angle_min,angle_increment,range_min,range_max,r0,r1,...\n";
}

void write_scan(std::ostream& out, const LaserScan& scan) {
  std::string line = scan.stamp.to_string();
  char number[40];
  for (const double value :
       {scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max}) {
    std::snprintf(number, sizeof number, ",%.9g", value);
    line += number;
  }
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.valid(i)) {
      std::snprintf(number, sizeof number, ",%.4f", static_cast<double>(scan.ranges[i]));
      line += number;
    } else {
      line += ",0";
    }
  }
  line += '\n';
  out << line;
}

}  // namespace lamina::io
