// Parses the text files of a dataset folder.
#include <lamina/sensors/readers/text_streams.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include <lamina/sensors/clock_order.hpp>
#include <lamina/sensors/scan_checks.hpp>
#include <lamina/sensors/text.hpp>
#include <lamina/sensors/time_order.hpp>

namespace lamina {
namespace {
constexpr std::size_t kMostBeams = 100000;
constexpr double kFurthest = 1e7;         // m; positions beyond are damage
constexpr double kQuaternionSlack = 0.1;  // off unit length: rounding at most
constexpr double kUnendedSlack = 2e-3;    // of three digits

// Items in the order of their stamps where the file has them in another; what was done, in words.
template <typename T>
std::vector<Warning> unshuffled(std::vector<T>& items, const std::string& file) {
  std::vector<Timestamp> stamps;
  for (const T& item : items) stamps.push_back(item.stamp);
  if (!is_shuffled(stamps)) return {};
  std::stable_sort(items.begin(), items.end(),
                   [](const T& a, const T& b) { return a.stamp < b.stamp; });
  return {{"clock_order", "lines of " + file +
                              " stand in another order than their stamps, which follow each other "
                              "evenly once put in order: they were taken in that order"}};
}

// Gives each item a stamp that can be, in the order of the file.
template <typename T>
void lay_in_order(std::vector<T>& items, StreamClock& clock) {
  add_warnings(clock.warnings, unshuffled(items, clock.name));
  ClockStream stream{clock.name, {}, {}};
  for (const T& item : items) stream.stamps.emplace_back(item.stamp);
  ClockOrderOptions options;
  options.place = [&](std::size_t i) { return clock.name + " entry " + std::to_string(i + 1); };
  const OrderedClock ordered = order_clocks({&stream, 1}, options);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Timestamp used = ordered.stamps[0][i];
    if (used != items[i].stamp) clock.recorded[used] = items[i].stamp;
    items[i].stamp = used;
  }
  clock.warnings.insert(clock.warnings.end(), ordered.warnings.begin(), ordered.warnings.end());
  clock.remarks.insert(clock.remarks.end(), ordered.remarks.begin(), ordered.remarks.end());
}

// Keeps what can stand in increasing time and counts the rest.
template <typename T>
std::vector<T> in_time_order(std::vector<T> items, SkipCounts& skips,
                             StreamClock* clock = nullptr) {
  if (clock != nullptr && !items.empty()) lay_in_order(items, *clock);
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

// What a scan's line holds without reading its numbers.
struct ScanShape {
  std::string_view header;  // angles and limits as they are written; empty where some are missing
  std::size_t ranges = 0;
};

ScanShape shape_of(std::string_view line) {
  constexpr std::size_t kHeader = 4;  // cells between stamp and ranges
  auto commas = static_cast<std::size_t>(std::count(line.begin(), line.end(), ','));
  const std::size_t last = line.find_last_not_of(" \t\r");
  if (last != std::string_view::npos && line[last] == ',') --commas;  // no range follows
  if (commas <= kHeader) return {};
  const std::size_t begin = line.find(',') + 1;
  std::size_t end = begin;
  for (std::size_t cell = 0; cell < kHeader; ++cell) end = line.find(',', end) + 1;
  return {line.substr(begin, end - begin), commas - kHeader};
}

// How many ranges scans of one header have.
class UsualLength {
 public:
  void add(std::size_t ranges) { ++counts_[ranges]; }
  // The most frequent; the longer of equals.
  std::size_t usual() const {
    std::size_t usual = 0;
    std::int64_t most = 0;
    for (const auto& [ranges, count] : counts_) {
      if (count >= most) usual = ranges;
      most = std::max(most, count);
    }
    return usual;
  }
  // Fewer ranges than usual are an accident here, not how the scanner is.
  bool shorter_is_rare() const {
    constexpr std::int64_t kEstablished = 3, kOneIn = 10;  // lines of the usual length; share
    const std::size_t length = usual();
    std::int64_t all = 0, fewer = 0;
    for (const auto& [ranges, count] : counts_) {
      all += count;
      fewer += ranges < length ? count : 0;
    }
    return counts_.at(length) >= kEstablished && fewer <= std::max<std::int64_t>(1, all / kOneIn);
  }

 private:
  std::map<std::size_t, std::int64_t> counts_;
};

// What recorders leave that were killed, and restarted perhaps.
void leave_out_cut_lines(std::vector<ScanLine>& scans, const char* text_end, SkipCounts& skips) {
  std::map<std::string_view, UsualLength> lengths;
  for (const ScanLine& scan : scans) {
    const ScanShape shape = shape_of(scan.line);
    if (!shape.header.empty()) lengths[shape.header].add(shape.ranges);
  }
  const auto cut = [&](const ScanLine& scan) {
    const bool unended = scan.line.data() + scan.line.size() == text_end;
    const ScanShape shape = shape_of(scan.line);
    const auto found = lengths.find(shape.header);
    const std::size_t usual = found == lengths.end() ? 0 : found->second.usual();
    if (found == lengths.end() ? !unended : shape.ranges >= usual) return false;
    if (!unended && !found->second.shorter_is_rare()) return false;
    skips.add(kSkipCutScan, 1,
              std::to_string(scan.number) + ": found " + std::to_string(shape.ranges) +
                  " ranges, expected " +
                  (usual > 0 ? std::to_string(usual) + " as in other lines of its angles"
                             : "a whole line"));
    return true;
  };
  std::erase_if(scans, cut);
}

// Stamp, angles and limits, taken off the line; null, or why they are none.
const char* read_scan_header(std::string_view& line, LaserScan& scan) {
  const auto stamp = Timestamp::parse(next_cell(line));
  if (!stamp) return kSkipNotANumber;
  scan.stamp = *stamp;
  double* const header[] = {&scan.angle_min, &scan.angle_increment, &scan.range_min,
                            &scan.range_max};
  for (double* value : header) {
    const std::string_view cell = next_cell(line);
    const auto number = parse_number_or_special(cell);
    if (cell.empty()) return kSkipShortLine;
    if (!number || std::isnan(*number)) return kSkipNotANumber;
    *value = *number;
  }
  if (std::isinf(scan.range_max)) scan.range_max = 0;  // no limit stated
  if (scan.range_max > 0 && !(scan.range_min < scan.range_max)) return kSkipRangeLimits;
  if (!std::isfinite(scan.angle_min) || !std::isfinite(scan.angle_increment) ||
      std::abs(scan.angle_min) > 1e3 || std::abs(scan.angle_increment) > 1e3 ||
      scan.angle_increment == 0 || !std::isfinite(scan.range_min)) {
    return kSkipNotANumber;
  }
  return nullptr;
}
}  // namespace

std::vector<ListEntry> parse_list(std::string_view text, SkipCounts& skips, StreamClock* clock) {
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
  return in_time_order(std::move(entries), skips, clock);
}

std::optional<LaserScan> parse_scan_line(std::string_view line, std::string& why,
                                         std::string* found) {
  LaserScan scan;
  if (const char* wrong = read_scan_header(line, scan)) {
    why = wrong;
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
  if (beyond_one_turn(scan.angle_increment, scan.size())) {
    why = kSkipBeyondTurn;
    if (found) *found = beyond_one_turn_text(scan.angle_increment, scan.size());
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
      scans.push_back({*stamp, line, lines.number()});
    } else {
      skips.add(kSkipNotANumber, 1, at_line(lines.number(), cell));
    }
  }
  leave_out_cut_lines(scans, text.data() + text.size(), skips);
  return scans;
}

std::vector<ScanLine> index_scans(std::string_view text, SkipCounts& skips, ScanStream& stream) {
  std::vector<ScanLine> lines = index_scans(text, skips);
  const std::vector<Warning> order = unshuffled(lines, "scans.csv");
  for (const ScanLine& line : lines) {
    std::string why;
    const LaserScan scan = parse_scan_line(line.line, why).value_or(LaserScan());
    stream.add(line.stamp, scan.ranges, scan.range_min, scan.range_max);
  }
  stream.finish([&](std::size_t k) { return "scans.csv:" + std::to_string(lines[k].number); });
  stream.warn(order);
  std::vector<ScanLine> used;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    if (const auto stamp = stream.stamp(k))
      used.push_back({*stamp, lines[k].line, lines[k].number});
  }
  return used;
}

std::vector<Odometry> parse_odometry(std::string_view text, SkipCounts& skips, StreamClock* clock) {
  std::vector<Odometry> samples;
  std::string_view line;
  for (LineReader lines(text); lines.next(line);) {
    if (is_comment(line)) continue;
    Timestamp stamp;
    double v[7];
    if (!read_numbers(lines, line, stamp, v, 7, skips)) continue;
    Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
    // A last line without an end may lack digits.
    const bool unended = line.data() + line.size() == text.data() + text.size();
    if (unended && !(std::abs(rotation.norm() - 1) <= kUnendedSlack)) {
      skips.add(kSkipShortLine, 1, at_line(lines.number(), line));
      continue;
    }
    if (!(std::abs(rotation.norm() - 1) <= kQuaternionSlack)) {
      skips.add("quaternion that is no rotation", 1, at_line(lines.number(), line));
      continue;
    }
    rotation.normalize();
    samples.push_back({stamp, SE3(SO3(rotation), {v[0], v[1], v[2]})});
  }
  return in_time_order(std::move(samples), skips, clock);
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
