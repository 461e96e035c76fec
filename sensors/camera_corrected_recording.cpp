// Corrects images on their way.
#include <lamina/sensors/camera_corrected_recording.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace lamina {

double matched_share(const StereoFrame& pair) {
  const DepthFrame frame = depth_from_stereo(pair);
  if (frame.raw.empty()) return 0;
  const auto none = std::count(frame.raw.begin(), frame.raw.end(), 0);
  return 1 - static_cast<double>(none) / static_cast<double>(frame.raw.size());
}

bool is_swapped(const StereoFrame& pair) {
  constexpr double kFew = 0.4, kMore = 2, kLeast = 0.1;  // of the pixels; of that share
  const double matched = matched_share(pair);
  if (matched >= kFew) return false;
  StereoFrame other = pair;
  std::swap(other.left, other.right);
  return matched_share(other) > std::max(kMore * matched, kLeast);
}

namespace {

// 1 / true = (1 / measured - offset) sqrt(1 + x^2 + y^2); saturated ones stay.
void correct_depths(const CameraCorrection& correction, DepthFrame& frame) {
  constexpr std::uint16_t kSaturated = std::numeric_limits<std::uint16_t>::max();
  const CameraModel& c = frame.camera.camera;
  const double offset = correction.offset / frame.camera.depth_scale;  // of raw units
  std::size_t i = 0;
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u, ++i) {
      const std::uint16_t raw = frame.raw[i];
      if (raw == 0 || raw == kSaturated) continue;
      const double ray =
          correction.along_ray ? std::hypot(1, (u - c.cx) / c.fx, (v - c.cy) / c.fy) : 1;
      const double inverse = (1.0 / raw - offset) * ray;
      frame.raw[i] = inverse * kSaturated > 1 ? static_cast<std::uint16_t>(1 / inverse + 0.5) : 0;
    }
  }
}

// What stands at u stood at u - px.
void move_rows(std::vector<std::uint8_t>& image, int width, double px) {
  const std::vector<std::uint8_t> before = image;
  const double whole = std::floor(px), part = px - whole;
  const auto rows = before.size() / static_cast<std::size_t>(width);
  for (std::size_t v = 0; v < rows; ++v) {
    const std::uint8_t* row = before.data() + v * static_cast<std::size_t>(width);
    const auto at = [&](int u) { return static_cast<double>(row[std::clamp(u, 0, width - 1)]); };
    for (int u = 0; u < width; ++u) {
      const int from = u - static_cast<int>(whole);
      image[v * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)] =
          static_cast<std::uint8_t>((1 - part) * at(from) + part * at(from - 1) + 0.5);
    }
  }
}

}  // namespace

void apply_to_depths(const CameraFixes& fixes, DepthFrame& frame) {
  if (fixes.depth_code) {
    const auto [least, most] = *fixes.depth_code;
    for (std::uint16_t& raw : frame.raw) raw = raw >= least && raw <= most ? 0 : raw;
  }
  if (fixes.robot.size() == frame.raw.size()) {
    for (std::size_t i = 0; i < frame.raw.size(); ++i) {
      if (fixes.robot[i]) frame.raw[i] = 0;
    }
  }
  if (fixes.depth.changes_depths()) correct_depths(fixes.depth, frame);
}

namespace {

void apply_to_model(const CameraFixes& fixes, DepthCamera& camera) {
  fixes.depth.apply(camera);
  if (fixes.depth_reach > 0)
    camera.noise.max_range = std::min(camera.noise.max_range, fixes.depth_reach);
}

}  // namespace

void apply(const CameraFixes& fixes, StereoFrame& pair) {
  if (fixes.swap_stereo || (fixes.swap_some && is_swapped(pair))) std::swap(pair.left, pair.right);
  const CameraModel& stated = pair.camera.camera;
  if (fixes.stereo.offset != 0)
    move_rows(pair.right, stated.width, fixes.stereo.offset * stated.fx * pair.camera.baseline);
  fixes.stereo.apply(pair.camera);
}

void apply(const CameraFixes& fixes, DepthFrame& frame) {
  apply_to_depths(fixes, frame);
  apply_to_model(fixes, frame.camera);
  for (int v = 0; v < frame.height() && fixes.depth.mirrored; ++v) {
    const auto row = frame.raw.begin() + static_cast<std::ptrdiff_t>(v) * frame.width();
    std::reverse(row, row + frame.width());
  }
}

CameraCorrectedRecording::CameraCorrectedRecording(std::unique_ptr<Recording> source,
                                                   const CameraFixes& fixes)
    : ForwardingRecording(std::move(source)), fixes_(fixes) {}

// A bag's camera is known with its first image.
const Calibration& CameraCorrectedRecording::calibration() const {
  calibration_ = source().calibration();
  if (calibration_.depth_camera) apply_to_model(fixes_, *calibration_.depth_camera);
  if (calibration_.stereo_camera) fixes_.stereo.apply(*calibration_.stereo_camera);
  return calibration_;
}

SkippedCounts CameraCorrectedRecording::skipped() const {
  auto all = source().skipped();
  if (dropped_ > 0) all["depth image of no use"] += dropped_;
  return all;
}

std::optional<Measurement> CameraCorrectedRecording::next_of_source() {
  while (auto measurement = source().next()) {
    if (auto* depth = std::get_if<DepthFrame>(&*measurement)) {
      if (fixes_.drop_depth) {
        ++dropped_;
        continue;
      }
      apply(fixes_, *depth);
    }
    if (auto* pair = std::get_if<StereoFrame>(&*measurement)) apply(fixes_, *pair);
    return measurement;
  }
  return std::nullopt;
}

std::optional<Measurement> CameraCorrectedRecording::next() {
  return fixes_.right_late != 0 ? next_with_later_right() : next_of_source();
}

// The first pair waits until the pair has come that holds its late image; what came between waits
// with it. The last pairs have none.
std::optional<Measurement> CameraCorrectedRecording::next_with_later_right() {
  const auto is_pair = [](const Measurement& m) { return std::holds_alternative<StereoFrame>(m); };
  while (true) {
    if (!held_.empty() && !is_pair(held_.front())) break;
    const auto pairs = std::count_if(held_.begin(), held_.end(), is_pair);
    if (pairs > std::abs(fixes_.right_late)) {
      auto later = held_.begin();
      for (int left = std::abs(fixes_.right_late); left > 0; --left) {
        later = std::find_if(later + 1, held_.end(), is_pair);
      }
      const auto late = fixes_.right_late > 0 ? &StereoFrame::right : &StereoFrame::left;
      std::get<StereoFrame>(held_.front()).*late = std::get<StereoFrame>(*later).*late;
      break;
    }
    if (ended_ && held_.empty()) return std::nullopt;
    if (ended_) {
      held_.pop_front();
      ++dropped_;
      continue;
    }
    auto measurement = next_of_source();
    if (!measurement) {
      ended_ = true;
    } else {
      held_.push_back(std::move(*measurement));
    }
  }
  Measurement first = std::move(held_.front());
  held_.pop_front();
  return first;
}

std::optional<DepthFrame> CameraCorrectedRecording::next_depth(std::int64_t skip) {
  if (fixes_.drop_depth) return std::nullopt;
  auto frame = source().next_depth(skip);
  if (frame) apply(fixes_, *frame);
  return frame;
}

std::unique_ptr<Recording> corrected(std::unique_ptr<Recording> source, const CameraFixes& fixes) {
  if (!fixes.any()) return source;
  return std::make_unique<CameraCorrectedRecording>(std::move(source), fixes);
}

}  // namespace lamina
