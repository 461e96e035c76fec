// scans.csv: 2D scans as the dataset folder has them.
#pragma once

#include <iosfwd>

#include <lamina/sensors/laser_scan.hpp>

namespace lamina::io {

/// The comment line that names the columns.
void write_scan_header(std::ostream& out);
/// `timestamp,angle_min,angle_increment,range_min,range_max,r0,r1,...`; no return is 0.
void write_scan(std::ostream& out, const LaserScan& scan);

}  // namespace lamina::io
