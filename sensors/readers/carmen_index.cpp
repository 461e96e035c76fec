// Indexes CARMEN logs.
#include <lamina/sensors/readers/carmen_index.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>

#include <lamina/sensors/scan_checks.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {
constexpr double kSaturatedShare = 1e-3;  // of all readings equal to the largest: no return
constexpr int kFront = 1, kRear = 2;      // devices whose place is known

// Several kinds of line often hold the same scans: ROBOTLASER states most, RAWLASER least.
int preference(CarmenKind kind) {
  switch (kind) {
    case CarmenKind::kRobotLaser:
      return 3;
    case CarmenKind::kFlaser:
    case CarmenKind::kRlaser:
      return 2;
    default:
      return 1;
  }
}

bool better(const CarmenSource& a, const CarmenSource& b) {
  // A kind that covers far less of the log is a leftover.
  if (2 * a.entries.size() < b.entries.size()) return false;
  if (2 * b.entries.size() < a.entries.size()) return true;
  return preference(a.tag.kind) > preference(b.tag.kind);
}

std::string at_line(int number, std::string_view line) {
  return std::to_string(number) + ": " + shown(line);
}

// By name where it is one (NEFF, NMEA-GGA), so that each kind is counted by itself.
std::string kind_not_read(std::string_view line) {
  constexpr std::size_t kLongest = 24;  // characters of a name
  const std::string_view word = next_field(line);
  const bool name =
      word.size() <= kLongest && std::all_of(word.begin(), word.end(), [](unsigned char c) {
        return std::isupper(c) != 0 || std::isdigit(c) != 0 || c == '_' || c == '-';
      });
  return name ? "kind of line not read: " + std::string(word) : "line of no kind";
}

void read_lines(std::string_view text, CarmenIndex& index, std::vector<CarmenSource>& all) {
  std::string_view line;
  std::string why;
  for (LineReader lines(text); lines.next(line);) {
    const CarmenTag tag = carmen_tag(line);
    if (tag.kind == CarmenKind::kOther) {
      if (!is_comment(line)) index.skips.add(kind_not_read(line));
      continue;
    }
    if (tag.kind == CarmenKind::kParam) {
      if (const auto param = parse_carmen_param(line)) index.params[param->first] = {param->second};
    } else if (tag.kind == CarmenKind::kOdom) {
      auto odom = parse_carmen_odom(line, why);
      if (odom) odom->line = lines.number();
      if (odom) index.odoms.push_back(*odom);
      if (!odom) index.skips.add(why, 1, at_line(lines.number(), line));
    } else if (const auto scan = parse_carmen_scan(tag, line, why)) {
      const double step = scan->angle_increment.value_or(0);
      if (beyond_one_turn(step, scan->ranges.size())) {
        index.skips.add(kSkipBeyondTurn, 1,
                        std::to_string(lines.number()) + ": " +
                            beyond_one_turn_text(step, scan->ranges.size()));
        continue;
      }
      const auto same = [&](const CarmenSource& s) {
        return s.tag.kind == tag.kind && s.tag.device == tag.device;
      };
      auto it = std::find_if(all.begin(), all.end(), same);
      if (it == all.end()) it = all.insert(it, CarmenSource{tag, {}, {}, NoReturnCode(), 0, 0, 0});
      it->add(*scan, line, lines.number());
    } else {
      index.skips.add(why, 1, at_line(lines.number(), line));
    }
  }
}

void choose_sources(std::vector<CarmenSource>& all, CarmenIndex& index) {
  for (const int device : {kFront, kRear}) {
    const CarmenSource* best = nullptr;
    for (const CarmenSource& source : all) {
      if (source.tag.device != device) continue;
      if (!best || better(source, *best)) best = &source;
    }
    for (const CarmenSource& source : all) {
      if (source.tag.device == device && &source != best) {
        index.skips.add("second record of the same laser",
                        static_cast<std::int64_t>(source.entries.size()));
      }
    }
    if (best) index.sources.push_back(*best);
  }
  for (const CarmenSource& source : all) {
    if (source.tag.device > kRear) {
      index.skips.add("laser whose place is unknown",
                      static_cast<std::int64_t>(source.entries.size()));
    }
  }
}

}  // namespace

SE3 to_se3(const CarmenPose& pose) { return SE3::planar(pose[0], pose[1], pose[2]); }

void CarmenSource::add(const CarmenScan& scan, std::string_view line, int number) {
  entries.push_back({line, scan.stamps, scan.robot, number, {}, {}});
  if (scan.laser && scan.robot) {
    mounts.push_back(to_se3(*scan.robot).inverse() * to_se3(*scan.laser));
  }
  code.add(scan.ranges);
  for (const float r : scan.ranges) {
    if (!std::isfinite(r)) continue;
    if (r > largest) {
      largest = r;
      at_largest = 0;
    }
    if (r == largest) ++at_largest;
    ++readings;
  }
}

bool CarmenSource::saturates() const {
  return static_cast<double>(at_largest) >
         std::max(3.0, kSaturatedShare * static_cast<double>(readings));
}

CarmenIndex index_carmen(std::string_view text) {
  CarmenIndex index;
  std::vector<CarmenSource> all;
  read_lines(text, index, all);
  choose_sources(all, index);
  return index;
}

}  // namespace lamina
