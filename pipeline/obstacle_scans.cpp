// Floor, obstacles and rims of each image, and the motion between sensors by wheels.
#include <lamina/pipeline/obstacle_scans.hpp>

#include <fmt/format.h>

#include <optional>
#include <ostream>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/motion/wheel_odometry.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/grid/evidence/scan_fusion.hpp>
#include <lamina/io/scan_files.hpp>

namespace lamina {
namespace {

void write_causes(std::ostream& out, const ObstacleScan& scan) {
  out << scan.stamp.to_string();
  for (std::size_t i = 0; i < scan.size(); ++i) {
    out << fmt::format(",{},{:.4f}", to_string(scan.cause[i]), scan.sigma[i]);
  }
  out << '\n';
}

std::optional<DepthFrame> depth_of(const Measurement& measurement) {
  if (const auto* depth = std::get_if<DepthFrame>(&measurement)) return *depth;
  if (const auto* pair = std::get_if<StereoFrame>(&measurement)) return depth_from_stereo(*pair);
  return std::nullopt;
}

}  // namespace

ObstacleScanCounts write_obstacle_scans(Recording& recording, const FrontEndOptions& options,
                                        const std::function<bool()>& ended, std::ostream& scans,
                                        std::ostream& causes) {
  FloorFrontend floor_front_end(options.floor);
  ObstacleScanner scanner(scan_options(options));
  CombinedScan combined;
  WheelTrack wheels(recording.calibration().odometry);
  const auto place = [&](Timestamp stamp) { return wheels.at(stamp).value_or(SE3()); };
  ObstacleScanCounts counts;
  io::write_scan_header(scans);
  causes << "# timestamp, then cause and sigma (m) of each beam\n";
  while (const auto measurement = recording.next()) {
    if (const auto* odometry = std::get_if<Odometry>(&*measurement)) wheels.add(*odometry);
    if (const auto* lidar = std::get_if<LaserScan>(&*measurement)) {
      io::write_scan(scans, combined.add(*lidar, CombinedScan::Kind::kLidar, place(lidar->stamp)));
      ++counts.lidar_scans;
    }
    const auto frame = depth_of(*measurement);
    if (!frame) continue;
    const FloorResult floor = floor_front_end.process(*frame);
    const ObstacleScan scan = scanner.process(*frame, floor, floor_front_end.disparities());
    LaserScan line = scan.to_laser_scan();
    line.lidar.T_body_lidar = floor.mounting.T_body_camera * floor.T_body_camera.inverse();
    io::write_scan(scans, combined.add(line, CombinedScan::Kind::kDepth, place(frame->stamp)));
    write_causes(causes, scan);
    ++counts.frames;
    counts.without_floor += floor.status != FloorStatus::kFound;
    for (const BeamCause cause : scan.cause) counts.negative_beams += is_negative(cause);
    if (ended()) {
      counts.whole = false;
      break;
    }
  }
  return counts;
}

}  // namespace lamina
