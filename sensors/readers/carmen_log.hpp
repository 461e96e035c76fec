// Lines of CARMEN logs: ODOM, FLASER, RLASER, ROBOTLASER1/2, RAWLASER1/2.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lamina/models/timestamp.hpp>
#include <lamina/sensors/readers/stamp_text.hpp>

namespace lamina {

enum class CarmenKind { kOdom, kFlaser, kRlaser, kRobotLaser, kRawLaser, kParam, kOther };

/// Which message a line holds; `device` is the number at the end of ROBOTLASERn and RAWLASERn.
struct CarmenTag {
  CarmenKind kind = CarmenKind::kOther;
  int device = 1;  ///< 1: front, 2: rear
};
CarmenTag carmen_tag(std::string_view line);

/// x, y (m), heading (rad).
using CarmenPose = std::array<double, 3>;

/// The two clocks of every line: the sending machine's and the logger's.
struct CarmenStamps {
  StampText ipc, logger;
};

struct CarmenOdom {
  CarmenPose pose{};
  CarmenStamps stamps;
  int line = 0;     ///< of the file
  Timestamp stamp;  ///< that is used
};

/// A scan as it stands in the log. Angles are stated by ROBOTLASER and RAWLASER only.
struct CarmenScan {
  std::vector<float> ranges;               ///< m
  std::optional<double> start_angle;       ///< rad
  std::optional<double> angle_increment;   ///< rad
  std::optional<double> max_range;         ///< m
  std::optional<double> accuracy;          ///< m
  std::optional<CarmenPose> laser, robot;  ///< in the odometry frame
  CarmenStamps stamps;
};

/// Parses a line of the kind named; on failure nullopt and `why` names the reason to count.
std::optional<CarmenOdom> parse_carmen_odom(std::string_view line, std::string& why);
std::optional<CarmenScan> parse_carmen_scan(CarmenTag tag, std::string_view line, std::string& why);
/// Name and number of a PARAM line; nullopt where the value is no number.
std::optional<std::pair<std::string, double>> parse_carmen_param(std::string_view line);

/// First angle and increment (rad) of FLASER and RLASER lines, which state neither: scans cover 180
/// degrees, n even without and n odd with the last beam; counts known from 240 and 270 degree
/// scanners (682, 683, 726; 541, 1081) have theirs.
std::pair<double, double> carmen_guess_angles(std::size_t beams);

/// What PARAM lines state of a laser; 0: nothing.
struct CarmenFieldOfView {
  double fov = 0;         ///< degrees; up to 2 pi: radians
  double resolution = 0;  ///< degrees between beams
};
/// As guessed, unless the field of view that is stated fits the beams: by the resolution that is
/// stated with it, or as n or n - 1 equal steps.
std::pair<double, double> carmen_angles(std::size_t beams, const CarmenFieldOfView& stated);

}  // namespace lamina
