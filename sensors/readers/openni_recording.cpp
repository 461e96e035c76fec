// OpenNI2: live cameras and .oni files.
#include <OpenNI.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/rectify.hpp>
#include <lamina/sensors/skip_counts.hpp>

namespace lamina {
namespace {
constexpr int kFileTimeoutMs = 2000;  // a file player that gives nothing for so long has ended
constexpr int kLiveTimeoutMs = 5000;  // a camera that gives nothing for so long is gone
// libOniFile's player walks its streams without a lock; a stopped one looks every 10 ms.
constexpr std::chrono::milliseconds kSettle(30);

std::string last_error() {
  std::string text = openni::OpenNI::getExtendedError();
  text = text.substr(0, text.find('\n'));
  return text.empty() ? "no reason given" : text;
}

// Everything of OpenNI's that must be taken down in one order: stop, wait, destroy, close, shut
// down. Any other order crashes the file player now and then.
class OpenNiSession {
 public:
  OpenNiSession(const std::string& uri, const std::string& name, const char* expected) {
    if (openni::OpenNI::initialize() != openni::STATUS_OK) {
      const std::string why = last_error();
      openni::OpenNI::shutdown();
      throw input_error(name, "", "OpenNI2 without drivers (" + why + ")", expected);
    }
    const char* target = uri.empty() ? openni::ANY_DEVICE : uri.c_str();
    if (device_.open(target) != openni::STATUS_OK) fail(name, "nothing OpenNI2 opens", expected);
    if (!device_.hasSensor(openni::SENSOR_DEPTH) ||
        depth_.create(device_, openni::SENSOR_DEPTH) != openni::STATUS_OK) {
      fail(name, "no depth stream", expected);
    }
  }
  ~OpenNiSession() { take_down(); }
  OpenNiSession(const OpenNiSession&) = delete;
  OpenNiSession& operator=(const OpenNiSession&) = delete;

  // A file's frames come one a read; set only after start(), or libOniFile crashes.
  void start(const std::string& name, const char* expected) {
    if (depth_.start() != openni::STATUS_OK)
      fail(name, "a depth stream that will not start", expected);
    started_ = true;
    if (openni::PlaybackControl* control = playback()) {
      control->setRepeatEnabled(false);
      control->setSpeed(-1.0f);
    }
  }
  // False when none comes in time. readFrame alone would block for ever at a file's end.
  bool wait_frame(int timeout_ms, openni::VideoFrameRef& frame) {
    openni::VideoStream* stream = &depth_;
    int index = 0;
    if (openni::OpenNI::waitForAnyStream(&stream, 1, &index, timeout_ms) != openni::STATUS_OK) {
      return false;
    }
    return depth_.readFrame(&frame) == openni::STATUS_OK && frame.isValid();
  }
  openni::PlaybackControl* playback() {
    return device_.isFile() ? device_.getPlaybackControl() : nullptr;
  }
  openni::VideoStream& depth() { return depth_; }

 private:
  [[noreturn]] void fail(const std::string& name, const char* found, const char* expected) {
    const std::string why = last_error();
    take_down();
    throw input_error(name, "", std::string(found) + " (" + why + ")", expected);
  }
  void take_down() {
    if (started_) depth_.stop();
    if (started_) std::this_thread::sleep_for(kSettle);
    started_ = false;
    depth_.destroy();
    device_.close();
    openni::OpenNI::shutdown();
  }

  openni::Device device_;
  openni::VideoStream depth_;
  bool started_ = false;
};

void check_image_size(const CameraModel& camera, const std::string& name) {
  if (camera.width <= 0 || camera.height <= 0 || camera.width > 16384 || camera.height > 16384) {
    throw input_error(
        name, "",
        "an image size of " + std::to_string(camera.width) + " x " + std::to_string(camera.height),
        "1 to 16384");
  }
}

/// The frame at its place (x0, y0) in a whole image; 0 around it.
void copy_cropped(const openni::VideoFrameRef& frame, int x0, int y0, const CameraModel& camera,
                  std::vector<std::uint16_t>& raw) {
  raw.assign(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 0);
  const auto row_bytes = static_cast<std::size_t>(frame.getWidth()) * sizeof(std::uint16_t);
  const auto stride = static_cast<std::size_t>(frame.getStrideInBytes());
  const auto* bytes = static_cast<const unsigned char*>(frame.getData());
  for (int v = 0; v < frame.getHeight(); ++v) {
    auto* row = raw.data() + static_cast<std::size_t>((y0 + v) * camera.width + x0);
    std::memcpy(row, bytes + static_cast<std::size_t>(v) * stride, row_bytes);
  }
}

class OpenNiRecording final : public Recording {
 public:
  OpenNiRecording(const std::string& uri, bool is_file, const RecordingOptions& options)
      : is_file_(is_file),
        name_(is_file ? uri : "openni:" + uri),
        expected_(is_file ? "an OpenNI2 recording with depth" : "a connected depth camera"),
        session_(uri, name_, expected_) {
    read_camera(options);
    if (openni::PlaybackControl* control = session_.playback()) {
      frames_ = control->getNumberOfFrames(session_.depth());
      if (frames_ <= 0) throw input_error(name_, "", "no depth frame", expected_);
    } else {
      session_.depth().setMirroringEnabled(false);
    }
    mirrored_ = session_.depth().getMirroringEnabled();
    if (mirrored_) remarks_.push_back("the stream is mirrored: frames are turned back");
    session_.start(name_, expected_);
  }

  std::optional<Measurement> next_light() override { return std::nullopt; }
  std::optional<Measurement> next() override {
    while (!done_) {
      openni::VideoFrameRef frame;
      if (!session_.wait_frame(is_file_ ? kFileTimeoutMs : kLiveTimeoutMs, frame)) {
        finish();
        return std::nullopt;
      }
      ++read_;
      if (is_file_ && (frame.getFrameIndex() >= frames_ || read_ >= frames_)) finish();
      if (auto result = convert(frame)) return result;
    }
    return std::nullopt;
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return skips_.counts(); }
  std::vector<std::string> remarks() const override { return remarks_; }
  std::vector<std::string> assumed() const override { return assumed_; }
  std::optional<std::int64_t> size_hint() const override {
    return is_file_ ? std::optional<std::int64_t>(frames_) : std::nullopt;
  }

 private:
  void finish() {
    done_ = true;
    if (is_file_) skips_.add("frames the player lost", frames_ - read_);
    if (!is_file_) remarks_.push_back("the camera gave no more frames");
  }
  void read_camera(const RecordingOptions& options);
  std::optional<Measurement> convert(const openni::VideoFrameRef& frame);

  bool is_file_;
  std::string name_;
  const char* expected_;
  OpenNiSession session_;
  Calibration calibration_;
  std::optional<Rectifier> rectifier_;
  SkipCounts skips_;
  std::vector<std::string> remarks_, assumed_;
  std::optional<Timestamp> last_;
  std::int64_t frames_ = 0, read_ = 0;
  bool mirrored_ = false, done_ = false;
};

// Focal lengths from the field of view: f = (size / 2) / tan(fov / 2); the principal point is the
// middle of the image.
void OpenNiRecording::read_camera(const RecordingOptions& options) {
  openni::VideoStream& stream = session_.depth();
  const openni::VideoMode mode = stream.getVideoMode();
  const openni::PixelFormat format = mode.getPixelFormat();
  const bool millimetres = format == openni::PIXEL_FORMAT_DEPTH_1_MM;
  if (!millimetres && format != openni::PIXEL_FORMAT_DEPTH_100_UM) {
    throw input_error(name_, "", "pixel format " + std::to_string(static_cast<int>(format)),
                      "depth in 1 mm or 100 um");
  }
  const CalibrationOverlay given(options.calibration);
  given.apply(calibration_);
  CameraModel camera;
  camera.width = mode.getResolutionX();
  camera.height = mode.getResolutionY();
  check_image_size(camera, name_);
  const double hfov = static_cast<double>(stream.getHorizontalFieldOfView());
  const double vfov = static_cast<double>(stream.getVerticalFieldOfView());
  const bool fov = hfov > 0.1 && hfov < 3 && vfov > 0.1 && vfov < 3;
  camera.fx = fov ? 0.5 * camera.width / std::tan(hfov / 2) : 0.9 * camera.width;
  camera.fy = fov ? 0.5 * camera.height / std::tan(vfov / 2) : camera.fx;
  if (!fov) remarks_.push_back("no field of view: a focal length of 0.9 widths is assumed");
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  camera.T_body_camera = forward_looking_camera();
  const double scale = millimetres ? 1000 : 10000;
  DepthCamera depth{camera, scale, DepthNoise::kinect(camera.fx)};
  given.apply(depth);
  if (depth.camera.width != camera.width || depth.camera.height != camera.height) {
    throw input_error(options.calibration->string(), "depth_camera",
                      "another size than the stream's",
                      std::to_string(camera.width) + " x " + std::to_string(camera.height));
  }
  depth.depth_scale = scale;  // the device says its units
  calibration_.depth_camera = depth;
  if (!given.states("depth_camera.T_body_camera"))
    assumed_.emplace_back("camera at the body's origin, looking forward");
  if (!fov && !given.states("depth_camera.fx"))
    assumed_.emplace_back("focal length of 0.9 image widths");
  rectifier_.emplace(calibration_.depth_camera->camera);
}

std::optional<Measurement> OpenNiRecording::convert(const openni::VideoFrameRef& frame) {
  const CameraModel& camera = calibration_.depth_camera->camera;
  const int w = frame.getWidth(), h = frame.getHeight();
  const int x0 = frame.getCroppingEnabled() ? frame.getCropOriginX() : 0;
  const int y0 = frame.getCroppingEnabled() ? frame.getCropOriginY() : 0;
  const auto row_bytes = static_cast<std::size_t>(std::max(w, 0)) * sizeof(std::uint16_t);
  const auto stride = static_cast<std::size_t>(frame.getStrideInBytes());
  const bool fits = w > 0 && h > 0 && x0 >= 0 && y0 >= 0 && x0 + w <= camera.width &&
                    y0 + h <= camera.height && stride >= row_bytes &&
                    static_cast<std::size_t>(frame.getDataSize()) >=
                        stride * static_cast<std::size_t>(h - 1) + row_bytes;
  if (!fits) {
    skips_.add(kSkipWrongSize);
    return std::nullopt;
  }
  const Timestamp stamp =
      Timestamp::from_nanoseconds(static_cast<std::int64_t>(frame.getTimestamp()) * 1000);
  if (last_ && stamp <= *last_) {
    skips_.add(kSkipTimeBack);
    return std::nullopt;
  }
  last_ = stamp;
  DepthFrame result{stamp, *calibration_.depth_camera, {}};
  copy_cropped(frame, x0, y0, camera, result.raw);
  if (mirrored_) {
    for (int v = 0; v < camera.height; ++v) {
      const auto row = result.raw.begin() + static_cast<std::ptrdiff_t>(v) * camera.width;
      std::reverse(row, row + camera.width);
    }
  }
  if (rectifier_->needed()) {
    result.raw = rectifier_->depth(result.raw);
    result.camera.camera.distortion.reset();
  }
  return result;
}
}  // namespace

std::unique_ptr<Recording> open_openni(const std::string& uri, bool is_file,
                                       const RecordingOptions& options) {
  return std::make_unique<OpenNiRecording>(uri, is_file, options);
}

}  // namespace lamina
