// Walks a recording and says what it holds.
#include <lamina/models/median.hpp>
#include <lamina/sensors/recording_info.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lamina {
namespace {
constexpr double kBin = 0.01;  // m, of the range histogram
constexpr std::size_t kMostBins = 100000;
constexpr double kGapFactor = 3;  // a gap is longer than this many median periods

const char* stream_name(const Measurement& m) {
  constexpr const char* kNames[] = {"depth",    "stereo", "scan",
                                    "odometry", "cloud",  "accelerometer"};
  static_assert(std::variant_size_v<Measurement> == std::size(kNames));
  return kNames[m.index()];
}

// Counts ranges into centimetres: the median of a million pixels a frame without keeping them.
class RangeStatistics {
 public:
  void add(double metres) {
    ++info_.samples;
    if (!(metres > 0) || !std::isfinite(metres)) {
      ++info_.invalid;
      return;
    }
    info_.least_m = valid() == 1 ? metres : std::min(info_.least_m, metres);
    info_.largest_m = std::max(info_.largest_m, metres);
    const auto bin = static_cast<std::size_t>(std::min(metres / kBin, kMostBins - 1.0));
    if (bin >= bins_.size()) bins_.resize(bin + 1);
    ++bins_[bin];
  }
  std::optional<RangeInfo> result() const {
    if (info_.samples == 0) return std::nullopt;
    RangeInfo info = info_;
    std::int64_t below = 0;
    for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
      below += bins_[bin];
      if (2 * below >= valid()) {
        info.median_m = (static_cast<double>(bin) + 0.5) * kBin;
        break;
      }
    }
    return info;
  }

 private:
  std::int64_t valid() const { return info_.samples - info_.invalid; }
  RangeInfo info_;
  std::vector<std::int64_t> bins_;
};

StreamInfo summarise(const std::vector<Timestamp>& stamps) {
  StreamInfo info;
  info.count = static_cast<std::int64_t>(stamps.size());
  info.first = stamps.front();
  info.last = stamps.back();
  std::vector<double> periods;
  for (std::size_t i = 1; i < stamps.size(); ++i) periods.push_back(stamps[i] - stamps[i - 1]);
  if (periods.empty()) return info;
  const auto longest = std::max_element(periods.begin(), periods.end());
  info.longest_gap_s = *longest;
  info.gap_begin = stamps[static_cast<std::size_t>(longest - periods.begin())];
  info.median_period_s = median(periods);
  info.gaps = std::count_if(periods.begin(), periods.end(), [&](double period) {
    return period > kGapFactor * info.median_period_s;
  });
  return info;
}

template <typename... Values>
void print(std::string& text, const char* format, Values... values) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, format, values...);
  text += buffer;
}

void print_pose(std::string& text, const char* name, const SE3& pose) {
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Quaterniond q = pose.so3().quaternion();
  print(text, "    %s: translation %.3f %.3f %.3f m, rotation xyzw %.4f %.4f %.4f %.4f\n", name,
        t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

void print_camera(std::string& text, const char* name, const CameraModel& c) {
  print(text, "  %s: %d x %d, fx %.2f fy %.2f cx %.2f cy %.2f%s\n", name, c.width, c.height, c.fx,
        c.fy, c.cx, c.cy, c.distortion ? ", distorted (frames are rectified)" : "");
  print_pose(text, "T_body_camera", c.T_body_camera);
}

void print_calibration(std::string& text, const Calibration& calibration) {
  text += "calibration\n";
  if (const auto& depth = calibration.depth_camera) {
    constexpr const char* kKinds[] = {"ideal", "kinect", "stereo"};
    print_camera(text, "depth_camera", depth->camera);
    print(text, "    model %s, %.6g raw units a metre, sigma at 3 m %.1f mm\n",
          kKinds[static_cast<int>(depth->noise.kind)], depth->depth_scale,
          1e3 * depth->noise.sigma_depth(3));
  }
  if (const auto& stereo = calibration.stereo_camera) {
    print_camera(text, "stereo_camera", stereo->camera);
    print(text, "    baseline %.4f m, disparity sigma %.3f px\n", stereo->baseline,
          stereo->disparity_sigma);
  }
  if (const auto& lidar = calibration.lidar) {
    print(text, "  lidar: range sigma %.3f m\n", lidar->noise.range_sigma);
    print_pose(text, "T_body_lidar", lidar->T_body_lidar);
  }
  print(text, "  odometry: sigma %.3f m, %.3f rad per sqrt(m), %s%s\n",
        calibration.odometry.sigma_translation, calibration.odometry.sigma_rotation,
        calibration.odometry.planar ? "planar" : "free",
        calibration.odometry_given ? "" : " (defaults)");
}

// Times count from the recording's first stamp on.
void print_streams(std::string& text, const RecordingInfo& info) {
  if (info.streams.empty()) return;
  text +=
      "stream             count   rate Hz     from s       to s   longest gap s        at s  "
      "gaps\n";
  for (const auto& [name, stream] : info.streams) {
    print(text, "  %-13s %8lld %9.2f %10.3f %10.3f %15.3f %11.3f %5lld\n", name.c_str(),
          static_cast<long long>(stream.count), stream.rate_hz(), stream.first - *info.first,
          stream.last - *info.first, stream.longest_gap_s,
          stream.count > 1 ? stream.gap_begin - *info.first : 0.0,
          static_cast<long long>(stream.gaps));
  }
}

void print_ranges(std::string& text, const char* name, const std::optional<RangeInfo>& info) {
  if (!info) return;
  print(text, "%s %.2f to %.2f m, median %.2f m, %.1f %% without measurement\n", name,
        info->least_m, info->largest_m, info->median_m, 100 * info->invalid_share());
}
}  // namespace

RecordingInfo inspect(Recording& recording) {
  RecordingInfo info;
  std::map<std::string, std::vector<Timestamp>> stamps;
  RangeStatistics depth, scan;
  std::optional<SE3> last_pose;
  while (const auto measurement = recording.next()) {
    const Timestamp stamp = stamp_of(*measurement);
    stamps[stream_name(*measurement)].push_back(stamp);
    if (const auto* frame = std::get_if<DepthFrame>(&*measurement)) {
      for (const std::uint16_t raw : frame->raw) depth.add(raw / frame->camera.depth_scale);
    } else if (const auto* beams = std::get_if<LaserScan>(&*measurement)) {
      for (std::size_t i = 0; i < beams->size(); ++i) {
        scan.add(beams->valid(i) ? static_cast<double>(beams->ranges[i]) : 0);
      }
    } else if (const auto* odometry = std::get_if<Odometry>(&*measurement)) {
      info.interpolated_odometry += odometry->interpolated ? 1 : 0;
      const SE3& pose = odometry->T_odom_body;
      if (last_pose) {
        info.odometry_path_m += (pose.translation() - last_pose->translation()).norm();
      }
      last_pose = pose;
    }
  }
  for (auto& [name, list] : recording.recorded_stamps()) {
    if (!list.empty()) stamps[name] = std::move(list);
  }
  for (const auto& [name, list] : stamps) {
    const StreamInfo stream = info.streams[name] = summarise(list);
    info.first = info.first ? std::min(*info.first, stream.first) : stream.first;
    info.last = info.last ? std::max(*info.last, stream.last) : stream.last;
  }
  info.depth = depth.result();
  info.scan = scan.result();
  info.calibration = recording.calibration();
  info.skipped = recording.skipped();
  info.first_skipped = recording.first_skipped();
  info.remarks = recording.remarks();
  info.warnings = recording.warnings();
  return info;
}

std::vector<std::string> partial_streams(const RecordingInfo& info) {
  constexpr double kSilence = 1, kPeriods = 5;  // s; of the stream itself
  std::vector<std::string> all;
  for (const auto& [name, stream] : info.streams) {
    const double usual = std::max(kSilence, kPeriods * stream.median_period_s);
    std::string text;
    if (const double late = stream.first - *info.first; late > usual) {
      print(text, "%s begins %.1f s after the recording does", name.c_str(), late);
    }
    if (const double early = *info.last - stream.last; early > usual) {
      print(text, "%s %.1f s before the recording does",
            text.empty() ? (name + " ends").c_str() : " and ends", early);
    }
    if (!text.empty()) all.push_back(text);
  }
  return all;
}

namespace {

// What no stream of the recording could contradict.
std::string unchecked(const RecordingInfo& info) {
  if (info.streams.count("scan") == 0 || info.odometry_path_m > 0) return {};
  return "no odometry that moves: whether the scanner's beams run the stated way round, and where "
         "ahead is, cannot be known; a mirrored or turned scanner gives a mirrored or turned map";
}

}  // namespace

std::string to_text(const RecordingInfo& info) {
  std::string text;
  if (info.first) {
    print(text, "span      %s to %s (%.3f s)\n", info.first->to_string().c_str(),
          info.last->to_string().c_str(), *info.last - *info.first);
  } else {
    text += "span      empty\n";
  }
  print_streams(text, info);
  print_ranges(text, "depth    ", info.depth);
  print_ranges(text, "scans    ", info.scan);
  if (info.streams.count("odometry") > 0) {
    print(text, "odometry  path %.2f m, %lld of the poses interpolated to sensor times\n",
          info.odometry_path_m, static_cast<long long>(info.interpolated_odometry));
  }
  print_calibration(text, info.calibration);
  for (const auto& [why, count] : info.skipped) {
    const auto first = info.first_skipped.find(why);
    text += "skipped   " + std::to_string(count) + " x " + why;
    if (first != info.first_skipped.end()) text += ", first " + first->second;
    text += "\n";
  }
  if (info.skipped.empty()) text += "skipped   nothing\n";
  for (const Warning& warning : info.warnings) text += "warning   " + warning.text + "\n";
  for (const std::string& remark : partial_streams(info)) text += "remark    " + remark + "\n";
  for (const std::string& remark : info.remarks) text += "remark    " + remark + "\n";
  if (const std::string none = unchecked(info); !none.empty()) text += "remark    " + none + "\n";
  return text;
}

}  // namespace lamina
