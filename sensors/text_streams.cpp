// Parses the text files of a dataset folder.
#include <lamina/sensors/text_streams.hpp>

#include <Eigen/Geometry>
#include <cmath>

#include <lamina/sensors/text.hpp>
#include <lamina/sensors/time_order.hpp>

namespace lamina {
namespace {
constexpr std::size_t kMostBeams = 100000;
constexpr double kFurthest = 1e7;         // m; positions beyond are damage
constexpr double kQuaternionSlack = 0.1;  // off unit length: rounding at most

// Keeps what can stand in increasing time and counts the rest.
template <typename T>
std::vector<T> in_time_order(std::vector<T> items, SkipCounts& skips) {
  std::vector<Timestamp> stamps;
  stamps.reserve(items.size());
  for (const T& item : items) stamps.push_back(item.stamp);
  const auto kept = longest_increasing(stamps);
  skips.add(kSkipTimeBack, static_cast<std::int64_t>(items.size() - kept.size()));
  if (kept.size() == items.size()) return items;
  std::vector<T> result;
  result.reserve(kept.size());
  for (const std::size_t i : kept) result.push_back(std::move(items[i]));
  return result;
}

// A line's place and what stands there.
std::string at_line(int number, std::string_view found) {
  return std::to_string(number) + ": " + shown(found);
}

// Stamp and `count` numbers; counts the reason and gives false when the line is none.
bool read_numbers(const LineReader& lines, std::string_view line, Timestamp& stamp, double* values,
                  int count, SkipCounts& skips) {
  const std::string_view whole = line, first = next_field(line);
  const auto time = Timestamp::parse(first);
  if (!time) {
    skips.add(kSkipNotANumber, 1, at_line(lines.number(), first));
    return false;
  }
  stamp = *time;
  for (int i = 0; i < count; ++i) {
    const std::string_view field = next_field(line);
    if (field.empty()) {
      skips.add(kSkipShortLine, 1, at_line(lines.number(), whole));
      return false;
    }
    const auto value = parse_number(field);
    if (!value || std::abs(*value) > kFurthest) {
      skips.add(kSkipNotANumber, 1, at_line(lines.number(), field));
      return false;
    }
    values[i] = *value;
  }
  return true;
}

std::string_view next_cell(std::string_view& rest) {
  const std::size_t comma = rest.find(',');
  std::string_view cell = rest.substr(0, comma);
  rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
  return next_field(cell);
}
}  // namespace

std::vector<ListEntry> parse_list(std::string_view text, SkipCounts& skips) {
  std::vector<ListEntry> entries;
  std::string_view line;
  for (LineReader lines(text); lines.next(line);) {
    if (is_comment(line)) continue;
    const std::string_view whole = line, first = next_field(line);
    const auto stamp = Timestamp::parse(first);
    const std::string_view path = next_field(line);
    if (!stamp) {
      skips.add(kSkipNotANumber, 1, at_line(lines.number(), first));
    } else if (path.empty()) {
      skips.add(kSkipShortLine, 1, at_line(lines.number(), whole));
    } else {
      entries.push_back({*stamp, std::string(path)});
    }
  }
  return in_time_order(std::move(entries), skips);
}

std::optional<LaserScan> parse_scan_line(std::string_view line, std::string& why) {
  LaserScan scan;
  const auto stamp = Timestamp::parse(next_cell(line));
  if (!stamp) {
    why = kSkipNotANumber;
    return std::nullopt;
  }
  scan.stamp = *stamp;
  double* const header[] = {&scan.angle_min, &scan.angle_increment, &scan.range_min,
                            &scan.range_max};
  for (double* value : header) {
    const std::string_view cell = next_cell(line);
    const auto number = parse_number_or_special(cell);
    if (cell.empty() || !number || std::isnan(*number)) {
      why = cell.empty() ? kSkipShortLine : kSkipNotANumber;
      return std::nullopt;
    }
    *value = *number;
  }
  if (std::isinf(scan.range_max)) scan.range_max = 0;  // no limit stated
  if (scan.range_max > 0 && !(scan.range_min < scan.range_max)) {
    why = kSkipRangeLimits;
    return std::nullopt;
  }
  if (!std::isfinite(scan.angle_min) || !std::isfinite(scan.angle_increment) ||
      std::abs(scan.angle_min) > 1e3 || std::abs(scan.angle_increment) > 1e3 ||
      scan.angle_increment == 0 || !std::isfinite(scan.range_min)) {
    why = kSkipNotANumber;
    return std::nullopt;
  }
  while (!line.empty() && scan.ranges.size() < kMostBeams) {
    const auto range = parse_number_or_special(next_cell(line));
    if (!range) {
      why = kSkipNotANumber;
      return std::nullopt;
    }
    scan.ranges.push_back(static_cast<float>(*range));
  }
  if (scan.ranges.size() < 2) {
    why = kSkipShortLine;
    return std::nullopt;
  }
  return scan;
}

std::vector<ScanLine> index_scans(std::string_view text, SkipCounts& skips) {
  std::vector<ScanLine> scans;
  std::string_view line;
  for (LineReader lines(text); lines.next(line);) {
    if (is_comment(line)) continue;
    std::string_view rest = line;
    const std::string_view cell = next_cell(rest);
    if (lines.number() == 1 && cell == "timestamp") continue;  // a heading
    const auto stamp = Timestamp::parse(cell);
    if (stamp) {
      scans.push_back({*stamp, line});
    } else {
      skips.add(kSkipNotANumber, 1, at_line(lines.number(), cell));
    }
  }
  return in_time_order(std::move(scans), skips);
}

std::vector<Odometry> parse_odometry(std::string_view text, SkipCounts& skips) {
  std::vector<Odometry> samples;
  std::string_view line;
  for (LineReader lines(text); lines.next(line);) {
    if (is_comment(line)) continue;
    Timestamp stamp;
    double v[7];
    if (!read_numbers(lines, line, stamp, v, 7, skips)) continue;
    Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
    if (!(std::abs(rotation.norm() - 1) <= kQuaternionSlack)) {
      skips.add("quaternion that is no rotation", 1, at_line(lines.number(), line));
      continue;
    }
    rotation.normalize();
    samples.push_back({stamp, SE3(SO3(rotation), {v[0], v[1], v[2]})});
  }
  return in_time_order(std::move(samples), skips);
}

std::vector<Accelerometer> parse_accelerometer(std::string_view text, SkipCounts& skips) {
  std::vector<Accelerometer> samples;
  std::string_view line;
  for (LineReader lines(text); lines.next(line);) {
    if (is_comment(line)) continue;
    Accelerometer sample;
    double v[3];
    if (!read_numbers(lines, line, sample.stamp, v, 3, skips)) continue;
    sample.acceleration_body = {v[0], v[1], v[2]};
    samples.push_back(sample);
  }
  return in_time_order(std::move(samples), skips);
}

}  // namespace lamina
