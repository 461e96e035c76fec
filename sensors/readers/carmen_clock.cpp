// Sender's or logger's clock; decimal or counted microseconds; order.
#include <lamina/sensors/readers/carmen_clock.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/median.hpp>
#include <lamina/sensors/clock_order.hpp>

namespace lamina {
namespace {

constexpr double kClockSkew = 0.5;  // s between machines before the logger's clock is trusted
constexpr double kOneIn = 0.01;     // of the lines: that much less disorder decides for a clock

// A line with a time: a scan of a source, or (source -1) odometry.
struct Line {
  int source = -1;
  std::size_t entry = 0;
  int number = 0;  // in the file
  CarmenStamps stamps;
};

std::vector<Line> lines_of(const CarmenIndex& index) {
  std::vector<Line> lines;
  for (std::size_t i = 0; i < index.odoms.size(); ++i) {
    lines.push_back({-1, i, index.odoms[i].line, index.odoms[i].stamps});
  }
  for (std::size_t s = 0; s < index.sources.size(); ++s) {
    const auto& entries = index.sources[s].entries;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      lines.push_back({static_cast<int>(s), i, entries[i].number, entries[i].stamps});
    }
  }
  std::sort(lines.begin(), lines.end(),
            [](const Line& a, const Line& b) { return a.number < b.number; });
  return lines;
}

std::optional<Timestamp> stamp_by(const CarmenStamps& stamps, bool logger, bool microseconds) {
  const StampText& text = logger ? stamps.logger : stamps.ipc;
  return microseconds ? text.microseconds : text.decimal;
}

bool counts_microseconds(const std::vector<Line>& lines, bool logger) {
  MicrosecondCheck check;
  for (const Line& line : lines) {
    check.add(logger ? line.stamps.logger : line.stamps.ipc, line.source);
  }
  return check.found();
}

// Of each stream, how many stamps do not come after the one before.
std::size_t disorder(const std::vector<Line>& lines, bool logger, bool microseconds) {
  std::map<int, std::optional<Timestamp>> last;
  std::size_t count = 0;
  for (const Line& line : lines) {
    const auto stamp = stamp_by(line.stamps, logger, microseconds);
    const auto before = last.find(line.source);
    if (before != last.end() && (!stamp || !before->second || *stamp <= *before->second)) ++count;
    last[line.source] = stamp;
  }
  return count;
}

// How far the two clocks of the streams are apart from each other.
double skew(const std::vector<Line>& lines) {
  std::map<int, std::vector<double>> offsets;
  for (const Line& line : lines) {
    const auto &ipc = line.stamps.ipc.decimal, &logger = line.stamps.logger.decimal;
    if (ipc && logger) offsets[line.source].push_back(*logger - *ipc);
  }
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (auto& [source, of_source] : offsets) {
    const auto middle = median(of_source);
    low = std::min(low, middle);
    high = std::max(high, middle);
  }
  return high - low;
}

// Where no stamp says how fast a robot went: at a walk.
double nominal_interval(const CarmenIndex& index) {
  constexpr double kSpeed = 0.5, kTurning = 0.7;   // m/s, rad/s
  constexpr double kShortest = 0.1, kLongest = 5;  // s
  if (index.sources.empty()) return kShortest;
  std::vector<double> needed;
  const CarmenPose* last = nullptr;
  for (const CarmenScanEntry& entry : index.sources.front().entries) {
    if (!entry.robot) continue;
    if (last != nullptr) {
      const SE3 moved = to_se3(*last).inverse() * to_se3(*entry.robot);
      needed.push_back(
          std::max(moved.translation().norm() / kSpeed, moved.so3().log().norm() / kTurning));
    }
    last = &*entry.robot;
  }
  if (needed.empty()) return kShortest;
  const auto most = needed.begin() + static_cast<std::ptrdiff_t>(needed.size() * 9 / 10);
  std::nth_element(needed.begin(), most, needed.end());
  return std::clamp(*most, kShortest, kLongest);
}

// Scans first: other streams are laid beside them.
std::vector<ClockStream> streams_of(const CarmenIndex& index, const std::vector<Line>& lines,
                                    bool microseconds) {
  std::vector<ClockStream> streams(index.sources.size() + (index.odoms.empty() ? 0 : 1));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool odometry = lines[i].source < 0;
    ClockStream& stream =
        streams[odometry ? index.sources.size() : static_cast<std::size_t>(lines[i].source)];
    stream.name = odometry ? "odometry" : lines[i].source == 0 ? "scans" : "the second laser";
    stream.stamps.push_back(stamp_by(lines[i].stamps, index.use_logger, microseconds));
    stream.lines.push_back(i);
  }
  return streams;
}

}  // namespace

CarmenClock apply_carmen_clock(CarmenIndex& index, const std::string& file) {
  const std::vector<Line> lines = lines_of(index);
  CarmenClock clock;
  const bool counted[2] = {counts_microseconds(lines, false), counts_microseconds(lines, true)};
  const auto ipc = static_cast<double>(disorder(lines, false, counted[0]));
  const auto logger = static_cast<double>(disorder(lines, true, counted[1]));
  const double decides = kOneIn * static_cast<double>(lines.size());
  index.use_logger = std::abs(ipc - logger) > decides ? logger < ipc : skew(lines) > kClockSkew;
  if (index.use_logger) {
    clock.remarks.emplace_back("the logger's clock is used: the senders' do not agree");
  }
  const bool microseconds = counted[index.use_logger ? 1 : 0];
  if (microseconds) {
    clock.warnings.push_back(
        {"stamp_digits",
         "no fraction of the stamps begins with a zero, and read as decimals they go "
         "back: read as counts of microseconds (12.345 is 12.000345)"});
  }
  ClockOrderOptions options;
  options.nominal_interval = nominal_interval(index);
  options.place = [&](std::size_t line) { return file + ":" + std::to_string(lines[line].number); };
  const std::vector<ClockStream> streams = streams_of(index, lines, microseconds);
  const OrderedClock ordered = order_clocks(streams, options);
  for (std::size_t s = 0; s < streams.size(); ++s) {
    for (std::size_t i = 0; i < ordered.stamps[s].size(); ++i) {
      const Timestamp stamp = ordered.stamps[s][i];
      if (s == index.sources.size()) {
        index.odoms[i].stamp = stamp;
        continue;
      }
      index.sources[s].entries[i].stamp = stamp;
      index.sources[s].entries[i].recorded = streams[s].stamps[i];
    }
  }
  clock.warnings.insert(clock.warnings.end(), ordered.warnings.begin(), ordered.warnings.end());
  clock.remarks.insert(clock.remarks.end(), ordered.remarks.begin(), ordered.remarks.end());
  return clock;
}

}  // namespace lamina
