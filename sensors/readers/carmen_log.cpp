// Parses lines of CARMEN logs.
#include <lamina/sensors/readers/carmen_log.hpp>

#include <cmath>

#include <lamina/sensors/skip_counts.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {
constexpr double kDegree = M_PI / 180;
constexpr std::int64_t kMostBeams = 100000;  // more is a damaged count
constexpr double kFurthest = 1e6;            // m; a range or position beyond is damage

// Takes fields off a line and remembers the first reason for failure.
class Fields {
 public:
  explicit Fields(std::string_view line) : rest_(line) {}

  std::string_view word() {
    const std::string_view field = next_field(rest_);
    if (field.empty()) fail(kSkipShortLine);
    return field;
  }
  double number(double largest = 1e12) {
    const std::string_view field = word();
    if (field.empty()) return 0;
    const auto value = parse_number(field);
    if (!value || std::abs(*value) > largest) fail(kSkipNotANumber);
    return value.value_or(0);
  }
  double range() {
    const std::string_view field = word();
    if (field.empty()) return 0;
    const auto value = parse_number_or_special(field);  // some loggers write nan
    if (!value) fail(kSkipNotANumber);
    return value.value_or(0);
  }
  std::int64_t count() {
    const std::string_view field = word();
    if (field.empty()) return 0;
    const auto value = parse_integer(field);
    if (!value || *value < 0 || *value > kMostBeams) {
      fail(kSkipNotANumber);
      return 0;
    }
    return *value;
  }
  CarmenPose pose() {
    CarmenPose pose{};
    for (double& value : pose) value = number(kFurthest);
    return pose;
  }
  // `ipc_stamp host logger_stamp`; the last is absent in some old logs.
  CarmenStamps stamps() {
    CarmenStamps stamps;
    stamps.ipc = stamp(word());
    const std::string_view host = next_field(rest_);
    const std::string_view logger = next_field(rest_);
    stamps.logger = host.empty() || logger.empty() ? stamps.ipc : stamp(logger);
    return stamps;
  }
  // Reads as far as the line goes: a count that lies about the line costs nothing.
  void ranges(std::int64_t count, std::vector<float>& values) {
    for (std::int64_t i = 0; i < count && ok(); ++i) values.push_back(static_cast<float>(range()));
  }
  bool ok() const { return why_.empty(); }
  const std::string& why() const { return why_; }

 private:
  StampText stamp(std::string_view field) {
    if (field.empty()) return {};
    const auto value = read_stamp(field);
    if (!value) fail(kSkipNotANumber);
    return value.value_or(StampText());
  }
  void fail(const char* why) {
    if (why_.empty()) why_ = why;
  }
  std::string_view rest_;
  std::string why_;
};

void read_flaser(Fields& fields, CarmenScan& scan) {
  fields.ranges(fields.count(), scan.ranges);
  scan.laser = fields.pose();
  scan.robot = fields.pose();
  scan.stamps = fields.stamps();
}

void read_configured(Fields& fields, CarmenScan& scan, bool with_robot) {
  fields.number();  // laser type
  scan.start_angle = fields.number(100);
  fields.number();  // field of view
  scan.angle_increment = fields.number(100);
  scan.max_range = fields.number(kFurthest);
  scan.accuracy = fields.number(kFurthest);
  fields.number();  // remission mode
  fields.ranges(fields.count(), scan.ranges);
  const std::int64_t remissions = fields.count();
  for (std::int64_t i = 0; i < remissions && fields.ok(); ++i) fields.word();
  if (with_robot) {
    scan.laser = fields.pose();
    scan.robot = fields.pose();
    for (int i = 0; i < 5; ++i) fields.number();  // velocities, safety distances, turn axis
  }
  scan.stamps = fields.stamps();
}

std::optional<int> device_number(std::string_view word, std::string_view prefix) {
  if (word.size() != prefix.size() + 1 || word.substr(0, prefix.size()) != prefix) {
    return std::nullopt;
  }
  const char digit = word.back();
  return digit >= '1' && digit <= '9' ? std::optional<int>(digit - '0') : std::nullopt;
}
}  // namespace

CarmenTag carmen_tag(std::string_view line) {
  const std::string_view word = next_field(line);
  if (word == "ODOM") return {CarmenKind::kOdom, 1};
  if (word == "FLASER") return {CarmenKind::kFlaser, 1};
  if (word == "RLASER") return {CarmenKind::kRlaser, 2};
  if (word == "PARAM") return {CarmenKind::kParam, 1};
  if (const auto device = device_number(word, "ROBOTLASER")) {
    return {CarmenKind::kRobotLaser, *device};
  }
  if (const auto device = device_number(word, "RAWLASER")) return {CarmenKind::kRawLaser, *device};
  return {};
}

std::optional<CarmenOdom> parse_carmen_odom(std::string_view line, std::string& why) {
  Fields fields(line);
  fields.word();
  CarmenOdom odom;
  odom.pose = fields.pose();
  for (int i = 0; i < 3; ++i) fields.number();  // velocities and acceleration
  odom.stamps = fields.stamps();
  why = fields.why();
  return fields.ok() ? std::optional(odom) : std::nullopt;
}

std::optional<CarmenScan> parse_carmen_scan(CarmenTag tag, std::string_view line,
                                            std::string& why) {
  Fields fields(line);
  fields.word();
  CarmenScan scan;
  if (tag.kind == CarmenKind::kFlaser || tag.kind == CarmenKind::kRlaser) {
    read_flaser(fields, scan);
  } else {
    read_configured(fields, scan, tag.kind == CarmenKind::kRobotLaser);
  }
  why = fields.why();
  if (fields.ok() && scan.ranges.size() < 2) why = "empty scan";
  if (fields.ok() && scan.angle_increment && *scan.angle_increment == 0) why = "no beam spacing";
  return why.empty() ? std::optional(std::move(scan)) : std::nullopt;
}

std::optional<std::pair<std::string, double>> parse_carmen_param(std::string_view line) {
  next_field(line);
  const std::string_view name = next_field(line);
  const auto value = parse_number(next_field(line));
  if (!value) return std::nullopt;
  return std::pair(std::string(name), *value);
}

std::pair<double, double> carmen_guess_angles(std::size_t beams) {
  switch (beams) {
    case 541:
      return {-135 * kDegree, 0.5 * kDegree};
    case 1081:
      return {-135 * kDegree, 0.25 * kDegree};
    case 682:
      return {-120 * kDegree, 360.0 / 1024 * kDegree};
    case 683:
      return {-120 * kDegree, 360.0 / 1024 * kDegree};
    case 726:
      return {-128 * kDegree, 360.0 / 1024 * kDegree};
    default:
      break;
  }
  const auto intervals = static_cast<double>(beams % 2 == 0 ? beams : beams - 1);
  return {-90 * kDegree, M_PI / intervals};
}

std::pair<double, double> carmen_angles(std::size_t beams, const CarmenFieldOfView& stated) {
  const auto guessed = carmen_guess_angles(beams);
  const double fov = stated.fov <= 2 * M_PI ? stated.fov : stated.fov * kDegree;
  if (!(fov > 0) || fov > 2 * M_PI + 1e-6 || beams < 2) return guessed;
  const double resolution = stated.resolution * kDegree;
  const auto n = static_cast<double>(beams);
  const auto fits = [&](double step) { return std::abs(step - resolution) < 0.05 * resolution; };
  // A resolution that fits the guess and not the field of view: that is of another laser.
  const bool other =
      resolution > 0 && fits(guessed.second) && !fits(fov / n) && !fits(fov / (n - 1));
  if (other) return guessed;
  const bool even = resolution > 0
                        ? std::abs(fov / n - resolution) < std::abs(fov / (n - 1) - resolution)
                        : beams % 2 == 0;
  return {-0.5 * fov, even ? fov / n : fov / (n - 1)};
}

}  // namespace lamina
