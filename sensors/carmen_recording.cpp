// CARMEN logs as a recording: one pass indexes the file, the second reads scans as they are asked.
#include <algorithm>
#include <cmath>
#include <deque>

#include <lamina/models/error.hpp>
#include <lamina/sensors/carmen_log.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/recording_sources.hpp>
#include <lamina/sensors/skip_counts.hpp>
#include <lamina/sensors/text.hpp>
#include <lamina/sensors/time_order.hpp>

namespace lamina {
namespace {
constexpr double kSickRangeMax = 80.0;  // m; SICK LMS write 81.83, 81.91 for no return
constexpr double kClockSkew = 0.5;      // s between machines before the logger's clock is trusted
constexpr double kMountSlack = 0.02;    // m and rad a fixed mounting may seem to move (rounding)
constexpr double kSaturatedShare =
    1e-3;  // of all readings equal to the largest: it means no return
constexpr double kAccuracyLow = 0.002, kAccuracyHigh = 0.2;  // m, believable in ROBOTLASER lines

SE3 to_se3(const CarmenPose& pose) { return SE3::planar(pose[0], pose[1], pose[2]); }

struct ScanEntry {
  std::string_view line;
  CarmenTag tag;
  CarmenStamps stamps;
  std::optional<CarmenPose> robot;
  Timestamp stamp;
};

// What the first pass learns of one kind of line from one device.
struct Source {
  CarmenTag tag;
  std::vector<ScanEntry> entries;
  std::vector<SE3> mounts;  // T_robot_laser of each line that states both
  float largest = 0;
  std::int64_t at_largest = 0, readings = 0;

  void add(const CarmenScan& scan, std::string_view line, CarmenTag line_tag) {
    entries.push_back({line, line_tag, scan.stamps, scan.robot, {}});
    if (scan.laser && scan.robot) {
      mounts.push_back(to_se3(*scan.robot).inverse() * to_se3(*scan.laser));
    }
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
  bool saturates() const {
    return static_cast<double>(at_largest) >
           std::max(3.0, kSaturatedShare * static_cast<double>(readings));
  }
};

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

bool better(const Source& a, const Source& b) {
  // A kind that covers far less of the log is a leftover.
  if (2 * a.entries.size() < b.entries.size()) return false;
  if (2 * b.entries.size() < a.entries.size()) return true;
  return preference(a.tag.kind) > preference(b.tag.kind);
}

// Which clock: 0 = sender's, 1 = logger's. The sender's, unless its stamps run back more often
// or machines disagree.
class ClockChoice {
 public:
  void add(int stream, const CarmenStamps& stamps) {
    Stream& s = streams_[stream];
    if (s.count > 0) {
      back_ipc_ += stamps.ipc < s.last.ipc ? 1 : 0;
      back_logger_ += stamps.logger < s.last.logger ? 1 : 0;
    }
    s.last = stamps;
    ++s.count;
    s.offsets.push_back(stamps.logger - stamps.ipc);
  }
  bool use_logger() {
    if (back_ipc_ != back_logger_) return back_logger_ < back_ipc_;
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (auto& [stream, s] : streams_) {
      const auto middle = s.offsets.begin() + static_cast<std::ptrdiff_t>(s.offsets.size() / 2);
      std::nth_element(s.offsets.begin(), middle, s.offsets.end());
      low = std::min(low, *middle);
      high = std::max(high, *middle);
    }
    return high - low > kClockSkew;
  }

 private:
  struct Stream {
    CarmenStamps last;
    std::size_t count = 0;
    std::vector<double> offsets;
  };
  std::map<int, Stream> streams_;
  std::int64_t back_ipc_ = 0, back_logger_ = 0;
};

class CarmenRecording final : public Recording {
 public:
  CarmenRecording(const std::filesystem::path& file, const RecordingOptions& options)
      : text_(read_file_bytes(file)), name_(file.string()) {
    index();
    choose_sources();
    if (sources_.empty() && odoms_.empty()) {
      throw input_error(name_, "", "no laser scan and no odometry",
                        "CARMEN lines (ODOM, FLASER, ROBOTLASER1, ...)");
    }
    apply_clock();
    choose_odometry();
    set_up_lidars(options);
    schedule();
  }

  std::optional<Measurement> next() override {
    while (pending_.empty() && position_ < order_.size()) read_entry(order_[position_++]);
    if (pending_.empty()) return std::nullopt;
    Measurement result = std::move(pending_.front());
    pending_.pop_front();
    return result;
  }
  const Calibration& calibration() const override { return calibration_; }
  std::map<std::string, std::int64_t> skipped() const override { return skips_.counts(); }
  std::vector<std::string> remarks() const override { return remarks_; }
  std::optional<std::int64_t> size_hint() const override {
    return static_cast<std::int64_t>(order_.size() * (sources_.empty() || track_.empty() ? 1 : 2));
  }

 private:
  void index();
  void choose_sources();
  void apply_clock();
  void choose_odometry();
  void set_up_lidars(const RecordingOptions& options);
  SE3 mounting(const Source& source);
  void schedule();
  void read_entry(std::pair<int, std::size_t> which);
  double range_limit(const Source& source, const CarmenScan& scan) const;

  std::string text_, name_;
  std::vector<Source> all_sources_, sources_;
  std::vector<CarmenOdom> odoms_;
  std::map<std::string, double> params_;
  bool use_logger_ = false;
  OdometryTrack track_;
  std::vector<LidarModel> lidars_;                  // of sources_
  std::vector<std::pair<int, std::size_t>> order_;  // (source, entry); source -1: odometry alone
  std::size_t position_ = 0;
  std::deque<Measurement> pending_;
  Calibration calibration_;
  SkipCounts skips_;
  std::vector<std::string> remarks_;
};

void CarmenRecording::index() {
  std::string_view line;
  std::string why;
  for (LineReader lines(text_); lines.next(line);) {
    const CarmenTag tag = carmen_tag(line);
    if (tag.kind == CarmenKind::kOther) continue;
    if (tag.kind == CarmenKind::kParam) {
      if (const auto param = parse_carmen_param(line)) params_[param->first] = param->second;
    } else if (tag.kind == CarmenKind::kOdom) {
      const auto odom = parse_carmen_odom(line, why);
      if (odom) odoms_.push_back(*odom);
      if (!odom) skips_.add(why);
    } else if (const auto scan = parse_carmen_scan(tag, line, why)) {
      const auto same = [&](const Source& s) {
        return s.tag.kind == tag.kind && s.tag.device == tag.device;
      };
      auto it = std::find_if(all_sources_.begin(), all_sources_.end(), same);
      if (it == all_sources_.end()) it = all_sources_.insert(it, Source{tag, {}, {}, 0, 0, 0});
      it->add(*scan, line, tag);
    } else {
      skips_.add(why);
    }
  }
}

void CarmenRecording::choose_sources() {
  for (const int device : {1, 2}) {
    const Source* best = nullptr;
    for (const Source& source : all_sources_) {
      if (source.tag.device != device) continue;
      if (!best || better(source, *best)) best = &source;
    }
    if (!best) continue;
    for (const Source& source : all_sources_) {
      if (source.tag.device == device && &source != best) {
        skips_.add("second record of the same laser",
                   static_cast<std::int64_t>(source.entries.size()));
      }
    }
    sources_.push_back(*best);
  }
  for (const Source& source : all_sources_) {
    if (source.tag.device > 2) {
      skips_.add("laser whose place is unknown", static_cast<std::int64_t>(source.entries.size()));
    }
  }
  all_sources_.clear();
}

void CarmenRecording::apply_clock() {
  ClockChoice clock;
  for (const CarmenOdom& odom : odoms_) clock.add(-1, odom.stamps);
  for (const Source& source : sources_) {
    for (const ScanEntry& entry : source.entries) clock.add(source.tag.device, entry.stamps);
  }
  use_logger_ = clock.use_logger();
  if (use_logger_) remarks_.push_back("the logger's clock is used: the senders' do not agree");
  for (Source& source : sources_) {
    for (ScanEntry& entry : source.entries) {
      entry.stamp = use_logger_ ? entry.stamps.logger : entry.stamps.ipc;
    }
  }
}

void CarmenRecording::choose_odometry() {
  std::vector<Odometry> samples;
  for (const CarmenOdom& odom : odoms_) {
    samples.push_back({use_logger_ ? odom.stamps.logger : odom.stamps.ipc, to_se3(odom.pose)});
  }
  if (samples.empty() && !sources_.empty()) {
    const auto& entries = sources_.front().entries;
    const bool moves = std::any_of(entries.begin(), entries.end(), [&](const ScanEntry& entry) {
      return entry.robot && entries.front().robot && *entry.robot != *entries.front().robot;
    });
    if (moves) {
      remarks_.push_back("no ODOM lines: the poses of the laser lines serve as odometry");
      for (const ScanEntry& entry : entries) {
        if (entry.robot) samples.push_back({entry.stamp, to_se3(*entry.robot)});
      }
    } else {
      remarks_.push_back("no odometry");
    }
  }
  track_ = OdometryTrack(samples);
  if (!odoms_.empty()) {
    skips_.add(kSkipTimeBack, static_cast<std::int64_t>(track_.dropped()));
  }
}

// T_body_lidar: from the poses of the lines where they agree with each other, else from PARAM.
SE3 CarmenRecording::mounting(const Source& source) {
  const bool rear = source.tag.device == 2;
  const auto param = params_.find(rear ? "robot_rearlaser_offset" : "robot_frontlaser_offset");
  SE3 mount = rear ? SE3::planar(0, 0, M_PI) : SE3();
  if (param != params_.end() && std::abs(param->second) < 5) {
    mount = SE3::planar(param->second, 0, 0) * mount;
  }
  if (source.mounts.empty()) return mount;
  std::vector<Vector6d> logs;
  for (const SE3& m : source.mounts) logs.push_back((source.mounts.front().inverse() * m).log());
  const bool fixed = std::all_of(logs.begin(), logs.end(), [](const Vector6d& d) {
    return d.cwiseAbs().maxCoeff() < kMountSlack;
  });
  const double offset = source.mounts.front().log().norm();
  // Equal poses state no mounting: many logs repeat one pose. Moving ones are a correction.
  if (fixed && offset > 1e-6) return source.mounts.front();
  return mount;
}

void CarmenRecording::set_up_lidars(const RecordingOptions& options) {
  if (options.calibration) calibration_ = read_calibration(*options.calibration);
  for (const Source& source : sources_) {
    LidarModel model;
    std::string why;
    const auto scan = parse_carmen_scan(source.tag, source.entries.front().line, why);
    if (scan && scan->accuracy && *scan->accuracy >= kAccuracyLow &&
        *scan->accuracy <= kAccuracyHigh) {
      model.noise.range_sigma = *scan->accuracy;
    }
    model.T_body_lidar = mounting(source);
    const bool front = source.tag.device == 1;
    if (front && calibration_.lidar) model = *calibration_.lidar;
    if (front) calibration_.lidar = model;
    lidars_.push_back(model);
  }
}

void CarmenRecording::schedule() {
  for (std::size_t s = 0; s < sources_.size(); ++s) {
    std::vector<Timestamp> stamps;
    for (const ScanEntry& entry : sources_[s].entries) stamps.push_back(entry.stamp);
    const auto kept = longest_increasing(stamps);
    skips_.add(kSkipTimeBack, static_cast<std::int64_t>(stamps.size() - kept.size()));
    for (const std::size_t i : kept) order_.emplace_back(static_cast<int>(s), i);
  }
  const auto stamp = [&](const std::pair<int, std::size_t>& which) {
    return sources_[static_cast<std::size_t>(which.first)].entries[which.second].stamp;
  };
  std::stable_sort(order_.begin(), order_.end(),
                   [&](const auto& a, const auto& b) { return stamp(a) < stamp(b); });
  if (sources_.empty()) {
    for (std::size_t i = 0; i < track_.trajectory().size(); ++i) order_.emplace_back(-1, i);
  }
}

double CarmenRecording::range_limit(const Source& source, const CarmenScan& scan) const {
  double limit = kSickRangeMax;
  const auto param =
      params_.find(source.tag.device == 2 ? "robot_rear_laser_max" : "robot_front_laser_max");
  if (param != params_.end() && param->second > 0) limit = param->second;
  if (scan.max_range && *scan.max_range > 0) limit = *scan.max_range;
  if (source.saturates()) limit = std::min(limit, static_cast<double>(source.largest));
  return limit;
}

void CarmenRecording::read_entry(std::pair<int, std::size_t> which) {
  if (which.first < 0) {
    const StampedPose& pose = track_.trajectory()[which.second];
    pending_.push_back(Odometry{pose.stamp, pose.pose});
    return;
  }
  const auto s = static_cast<std::size_t>(which.first);
  const ScanEntry& entry = sources_[s].entries[which.second];
  std::string why;
  auto raw = parse_carmen_scan(entry.tag, entry.line, why);
  LAMINA_CHECK(raw.has_value());  // the first pass read it
  LaserScan scan;
  scan.stamp = entry.stamp;
  const auto [first, step] = carmen_guess_angles(raw->ranges.size());
  scan.angle_min = raw->start_angle.value_or(first);
  scan.angle_increment = raw->angle_increment.value_or(step);
  scan.range_max = range_limit(sources_[s], *raw);
  scan.lidar = lidars_[s];
  scan.ranges = std::move(raw->ranges);
  const auto limit = static_cast<float>(scan.range_max);  // rounded as the ranges were
  for (float& r : scan.ranges) {
    if (r >= limit) r = HUGE_VALF;  // no return
  }
  if (auto odometry = track_.at(entry.stamp)) pending_.push_back(*odometry);
  pending_.push_back(std::move(scan));
}
}  // namespace

std::unique_ptr<Recording> open_carmen_log(const std::filesystem::path& file,
                                           const RecordingOptions& options) {
  return std::make_unique<CarmenRecording>(file, options);
}

}  // namespace lamina
