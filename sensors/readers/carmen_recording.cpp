// CARMEN logs as a recording: one pass indexes the file, the second reads scans as they are asked.
#include <algorithm>
#include <cmath>
#include <deque>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/clock_order.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/readers/carmen_clock.hpp>
#include <lamina/sensors/readers/carmen_index.hpp>
#include <lamina/sensors/readers/compressed_text.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/skip_counts.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {
constexpr double kSickRangeMax = 80.0;  // m; SICK LMS write 81.83, 81.91 for no return
constexpr double kMountSlack = 0.02;    // m and rad a fixed mounting may seem to move (rounding)
constexpr double kFurthestMount = 5;    // m from the robot's centre
constexpr double kAccuracyOfAny = 0.1;  // what drivers write for any scanner
constexpr double kAccuracyLow = 0.002, kAccuracyHigh = 0.2;  // m, believable in ROBOTLASER lines

class CarmenRecording final : public Recording {
 public:
  CarmenRecording(std::string text, const std::string& name, const RecordingOptions& options,
                  bool cut = false)
      : name_(name), text_(std::move(text)), index_(index_carmen(text_)), skips_(index_.skips) {
    if (index_.sources.empty() && index_.odoms.empty()) {
      throw input_error(name, "", "no laser scan and no odometry" + skips_.summary(", first line "),
                        "CARMEN lines (ODOM, FLASER, ROBOTLASER1, ...)");
    }
    const CarmenClock clock =
        apply_carmen_clock(index_, std::filesystem::path(name).filename().string());
    warnings_ = clock.warnings;
    remarks_ = clock.remarks;
    if (cut) skips_.add("damaged end of file");
    choose_odometry();
    set_up_lidars(options);
    find_codes();
    find_fields_of_view();
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
  SkippedCounts skipped() const override { return skips_.counts(); }
  std::map<std::string, std::string> first_skipped() const override {
    std::map<std::string, std::string> firsts;
    const std::string file = std::filesystem::path(name_).filename().string();
    for (const auto& [why, place] : skips_.firsts()) firsts[why] = file + ":" + place;
    return firsts;
  }
  std::map<std::string, std::vector<Timestamp>> recorded_stamps() const override {
    return {{"odometry", track_.stamps()}};
  }
  std::map<Timestamp, Timestamp> restamped() const override;
  std::vector<std::string> remarks() const override { return remarks_; }
  std::vector<std::string> assumed() const override { return assumed_; }
  std::vector<Warning> warnings() const override { return warnings_; }
  std::optional<std::int64_t> size_hint() const override {
    return static_cast<std::int64_t>(order_.size() *
                                     (index_.sources.empty() || track_.empty() ? 1 : 2));
  }

 private:
  void choose_odometry();
  void set_up_lidars(const RecordingOptions& options);
  std::optional<SE3> mounting(const CarmenSource& source) const;
  void schedule();
  void read_entry(std::pair<int, std::size_t> which);
  double no_return_from(std::size_t s) const;
  double stated_limit(const CarmenSource& source, const CarmenScan& scan) const;
  void find_codes();
  void find_fields_of_view();

  std::string name_, text_;
  CarmenIndex index_;
  OdometryTrack track_;
  std::vector<LidarModel> lidars_;                  // one a source
  std::vector<std::optional<double>> codes_;        // likewise: ranges that mean no return
  std::vector<CarmenFieldOfView> fields_of_view_;   // likewise, where lines state none
  std::vector<std::pair<int, std::size_t>> order_;  // (source, entry); source -1: odometry alone
  std::size_t position_ = 0;
  std::deque<Measurement> pending_;
  Calibration calibration_;
  SkipCounts skips_;
  std::vector<std::string> remarks_, assumed_;
  std::vector<Warning> warnings_;
};

std::map<Timestamp, Timestamp> CarmenRecording::restamped() const {
  std::map<Timestamp, Timestamp> recorded;
  std::vector<Timestamp> frames;
  for (const auto& [source, i] : order_) {
    if (source < 0) return {};
    const CarmenScanEntry& entry = index_.sources[static_cast<std::size_t>(source)].entries[i];
    if (!entry.recorded) return {};
    frames.push_back(entry.stamp);
    if (*entry.recorded != entry.stamp) recorded[entry.stamp] = *entry.recorded;
  }
  return where_increasing(recorded, frames);
}

void CarmenRecording::choose_odometry() {
  std::vector<Odometry> samples;
  for (const CarmenOdom& odom : index_.odoms) {
    samples.push_back({odom.stamp, to_se3(odom.pose)});
  }
  if (samples.empty() && !index_.sources.empty()) {
    const auto& entries = index_.sources.front().entries;
    const bool moves =
        std::any_of(entries.begin(), entries.end(), [&](const CarmenScanEntry& entry) {
          return entry.robot && entries.front().robot && *entry.robot != *entries.front().robot;
        });
    if (moves) {
      remarks_.push_back("no ODOM lines: the poses of the laser lines serve as odometry");
      for (const CarmenScanEntry& entry : entries) {
        if (entry.robot) samples.push_back({entry.stamp, to_se3(*entry.robot)});
      }
    } else {
      remarks_.push_back("no odometry");
    }
  }
  track_ = OdometryTrack(samples);
}

SE3 facing_of(const CarmenSource& source) {
  return source.tag.device == 2 ? SE3::planar(0, 0, M_PI) : SE3();
}

// T_body_lidar: from the poses of the lines where they agree with each other. Equal poses mean the
// body is the laser, whatever PARAM says: corrected logs give both so (freiburg-079's map is
// sharpest at 0, not at its PARAM of -0.04 m). Lines without poses, or with a moving difference,
// take PARAM.
// nullopt: neither says where it sits.
std::optional<SE3> CarmenRecording::mounting(const CarmenSource& source) const {
  const bool rear = source.tag.device == 2;
  const SE3 facing = facing_of(source);
  if (!source.mounts.empty()) {
    const SE3& first = source.mounts.front();
    const bool fixed = std::all_of(source.mounts.begin(), source.mounts.end(), [&](const SE3& m) {
      return (first.inverse() * m).log().cwiseAbs().maxCoeff() < kMountSlack;
    });
    if (fixed && (first.log().norm() > 1e-6 || !rear)) return first;
    if (fixed) return std::nullopt;
  }
  const auto& params = index_.params;
  const auto param = params.find(rear ? "robot_rearlaser_offset" : "robot_frontlaser_offset");
  const bool stated = param != params.end() && std::abs(param->second.value) < kFurthestMount;
  return stated ? std::optional(SE3::planar(param->second.value, 0, 0) * facing) : std::nullopt;
}

void CarmenRecording::set_up_lidars(const RecordingOptions& options) {
  const CalibrationOverlay given(options.calibration);
  given.apply(calibration_);
  for (const CarmenSource& source : index_.sources) {
    LidarModel model;
    std::string why;
    const auto scan = parse_carmen_scan(source.tag, source.entries.front().line, why);
    if (scan && scan->accuracy && *scan->accuracy >= kAccuracyLow &&
        *scan->accuracy <= kAccuracyHigh && *scan->accuracy != kAccuracyOfAny) {
      model.noise.range_sigma = *scan->accuracy;
    } else if (source.tag.device == 1 && !given.states("lidar.range_sigma")) {
      assumed_.push_back("lidar.range_sigma: " + default_range_sigma());
    }
    const std::optional<SE3> stated = mounting(source);
    model.T_body_lidar = stated.value_or(facing_of(source));
    const bool front = source.tag.device == 1;
    // A file has one lidar: where it sits and how noisy it is are said of the front's.
    if (front) given.apply(model);
    if (front) calibration_.lidar = model;
    if (!stated && !(front && given.states("lidar.T_body_lidar")))
      assumed_.push_back(front ? "front laser at the body's origin, facing forward"
                               : "rear laser at the body's origin, facing backward");
    lidars_.push_back(model);
  }
}

void CarmenRecording::schedule() {
  for (std::size_t s = 0; s < index_.sources.size(); ++s) {
    for (std::size_t i = 0; i < index_.sources[s].entries.size(); ++i) {
      order_.emplace_back(static_cast<int>(s), i);
    }
  }
  const auto stamp = [&](const std::pair<int, std::size_t>& which) {
    return index_.sources[static_cast<std::size_t>(which.first)].entries[which.second].stamp;
  };
  std::stable_sort(order_.begin(), order_.end(),
                   [&](const auto& a, const auto& b) { return stamp(a) < stamp(b); });
  if (index_.sources.empty()) {
    for (std::size_t i = 0; i < track_.trajectory().size(); ++i) order_.emplace_back(-1, i);
  }
}

// Codes for no return that neither the limit nor the largest reading shows.
void CarmenRecording::find_codes() {
  for (const CarmenSource& source : index_.sources) {
    codes_.push_back(source.code.code());
    std::string why;
    const auto scan = parse_carmen_scan(source.tag, source.entries.front().line, why);
    if (!scan || !codes_.back()) continue;
    const double limit = stated_limit(source, *scan);
    if (*codes_.back() + 0.05 < limit) warnings_.push_back(source.code.warning(*codes_.back(), 0));
  }
}

// FLASER lines state no angles; PARAM lines may.
void CarmenRecording::find_fields_of_view() {
  for (const CarmenSource& source : index_.sources) {
    const std::string laser = source.tag.device == 2 ? "laser_rear_laser_" : "laser_front_laser_";
    CarmenFieldOfView& stated = fields_of_view_.emplace_back();
    const auto fov = index_.params.find(laser + "fov");
    const auto resolution = index_.params.find(laser + "resolution");
    if (fov != index_.params.end()) stated.fov = fov->second.value;
    if (resolution != index_.params.end()) stated.resolution = resolution->second.value;
    std::string why;
    const auto scan = parse_carmen_scan(source.tag, source.entries.front().line, why);
    if (!scan || scan->angle_increment) continue;
    const std::size_t beams = scan->ranges.size();
    const double step = carmen_angles(beams, stated).second;
    if (std::abs(step - carmen_guess_angles(beams).second) < 1e-4) continue;
    remarks_.push_back(std::to_string(beams) + " beams " + std::to_string(step * 180 / M_PI) +
                       " degrees apart, as PARAM " + laser + "fov says");
  }
}

double CarmenRecording::no_return_from(std::size_t s) const {
  const CarmenSource& source = index_.sources[s];
  const double largest = source.saturates() ? static_cast<double>(source.largest) : kSickRangeMax;
  return std::min(largest, codes_[s].value_or(kSickRangeMax));
}

double CarmenRecording::stated_limit(const CarmenSource& source, const CarmenScan& scan) const {
  double limit = kSickRangeMax;
  const auto param =
      index_.params.find(source.tag.device == 2 ? "robot_rear_laser_max" : "robot_front_laser_max");
  if (param != index_.params.end() && param->second.value > 0) limit = param->second.value;
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
  const CarmenScanEntry& entry = index_.sources[s].entries[which.second];
  std::string why;
  auto raw = parse_carmen_scan(index_.sources[s].tag, entry.line, why);
  LAMINA_CHECK(raw.has_value());  // the first pass read it
  LaserScan scan;
  scan.stamp = entry.stamp;
  const auto [first, step] = carmen_angles(raw->ranges.size(), fields_of_view_[s]);
  scan.angle_min = raw->start_angle.value_or(first);
  scan.angle_increment = raw->angle_increment.value_or(step);
  const double no_return = no_return_from(s);
  scan.range_max = std::min(stated_limit(index_.sources[s], *raw), no_return);
  scan.lidar = lidars_[s];
  scan.ranges = std::move(raw->ranges);
  // What is stated is a claim (drivers state limits of their own): no reading is lost to it.
  const auto limit = static_cast<float>(no_return);  // rounded as the ranges were
  for (float& r : scan.ranges) {
    if (r >= limit) r = HUGE_VALF;  // no return
  }
  if (auto odometry = track_.at(entry.stamp)) pending_.push_back(*odometry);
  pending_.push_back(std::move(scan));
}
}  // namespace

std::unique_ptr<Recording> open_carmen_log(const std::filesystem::path& file,
                                           const RecordingOptions& options) {
  TextBytes bytes = read_text_bytes(file);
  return std::make_unique<CarmenRecording>(std::move(bytes.text), file.string(), options,
                                           bytes.cut);
}

std::unique_ptr<Recording> open_carmen_text(std::string text, const std::string& name,
                                            const RecordingOptions& options) {
  return std::make_unique<CarmenRecording>(std::move(text), name, options);
}

}  // namespace lamina
