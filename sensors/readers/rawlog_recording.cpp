// MRPT .rawlog files, both kinds: actions and sensory frames, and plain observations.
#include <mrpt/core/Clock.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservation3DRangeScan.h>
#include <mrpt/obs/CObservationIMU.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationStereoImages.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/serialization/CArchive.h>
#include <zlib.h>

#include <deque>
#include <mutex>
#include <set>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/readers/planar_odometry.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/readers/reorder_buffer.hpp>
#include <lamina/sensors/rectify.hpp>
#include <lamina/sensors/scan_checks.hpp>
#include <lamina/sensors/skip_counts.hpp>

namespace lamina {
namespace {
namespace obs = mrpt::obs;

SE3 to_se3(const mrpt::poses::CPose3D& pose) {
  const auto R = pose.getRotationMatrix();
  Eigen::Matrix3d rotation;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) rotation(r, c) = R(r, c);
  }
  return {SO3::from_matrix(rotation), {pose.x(), pose.y(), pose.z()}};
}

std::optional<Timestamp> to_stamp(const mrpt::Clock::time_point& time) {
  if (time == mrpt::Clock::time_point()) return std::nullopt;
  constexpr std::int64_t kUnixEpoch = 116444736000000000;  // in 100 ns since 1601
  const std::int64_t ticks = time.time_since_epoch().count();
  if (ticks < kUnixEpoch || ticks > 2 * kUnixEpoch) return std::nullopt;
  return Timestamp::from_nanoseconds((ticks - kUnixEpoch) * 100);
}

CameraModel to_camera(const mrpt::img::TCamera& in, int width, int height) {
  CameraModel camera;
  camera.width = width;
  camera.height = height;
  camera.fx = in.fx();
  camera.fy = in.fy();
  camera.cx = in.cx();
  camera.cy = in.cy();
  const std::array<double, 5> d{in.k1(), in.k2(), in.p1(), in.p2(), in.k3()};
  if (std::any_of(d.begin(), d.end(), [](double x) { return x != 0; })) camera.distortion = d;
  return camera;
}

bool is_empty(const obs::CObservation2DRangeScan& scan) {
  return scan.getScanSize() < 2 || !(scan.aperture > 0);
}

LidarModel to_lidar(const obs::CObservation2DRangeScan& scan) {
  LidarModel lidar;
  lidar.T_body_lidar = to_se3(scan.sensorPose);
  if (scan.stdError > 0 && scan.stdError < 0.5f) {
    lidar.noise.range_sigma = static_cast<double>(scan.stdError);
  }
  return lidar;
}

std::optional<SE3> movement(const obs::CActionCollection& actions) {
  for (std::size_t i = 0; i < actions.size(); ++i) {
    const obs::CAction& action = actions.get(i);
    if (const auto* planar = dynamic_cast<const obs::CActionRobotMovement2D*>(&action)) {
      mrpt::poses::CPose2D step = planar->rawOdometryIncrementReading;
      if (planar->estimationMethod != obs::CActionRobotMovement2D::emOdometry &&
          planar->poseChange) {
        planar->poseChange->getMean(step);
      }
      return SE3::planar(step.x(), step.y(), step.phi());
    }
    if (const auto* full = dynamic_cast<const obs::CActionRobotMovement3D*>(&action)) {
      return to_se3(full->poseChange.mean);
    }
  }
  return std::nullopt;
}

// False when a gzip file is cut short: its beginning is good. Throws when it is damaged within:
// MRPT would believe the sizes it unpacks there and crash.
bool is_whole(const std::string& file) {
  gzFile in = gzopen(file.c_str(), "rb");
  if (!in) throw input_error(file, "", "a file that cannot be opened", "an MRPT rawlog");
  std::vector<char> buffer(1 << 16);
  int count = 0;
  while ((count = gzread(in, buffer.data(), static_cast<unsigned>(buffer.size()))) > 0) continue;
  const int code = gzclose(in);
  if (count < 0 && code != Z_BUF_ERROR) {
    throw input_error(file, "", "damaged gzip data", "an MRPT rawlog whose checksum is right");
  }
  return count == 0 && code == Z_OK;
}

// The objects of a rawlog one after another; a whole CRawlog object is unpacked.
class ObjectStream {
 public:
  explicit ObjectStream(const std::string& file) {
    if (!stream_.open(file)) {
      throw input_error(file, "", "a file that cannot be opened", "an MRPT rawlog");
    }
  }
  // nullptr at the end; `damaged` is set when the end is not the file's own.
  mrpt::serialization::CSerializable::Ptr next() {
    if (!unpacked_.empty()) {
      auto object = unpacked_.front();
      unpacked_.pop_front();
      return object;
    }
    try {
      auto object = read_object();
      const auto whole = std::dynamic_pointer_cast<obs::CRawlog>(object);
      if (!whole) return object;
      for (std::size_t i = 0; i < whole->size(); ++i) {
        unpacked_.push_back(whole->getAsGeneric(i));
      }
      return next();
    } catch (const mrpt::serialization::CExceptionEOF&) {
      return nullptr;
    } catch (const std::exception&) {
      damaged_ = !stream_.checkEOF();
      return nullptr;
    }
  }
  bool damaged() const { return damaged_; }

 private:
  // One recording may be read beside another: MRPT's list of classes is looked up without a lock.
  mrpt::serialization::CSerializable::Ptr read_object() {
    static std::mutex one_at_a_time;
    const std::lock_guard lock(one_at_a_time);
    auto archive = mrpt::serialization::archiveFrom(stream_);
    return archive.ReadObject();
  }

  mrpt::io::CFileGZInputStream stream_;
  std::deque<mrpt::serialization::CSerializable::Ptr> unpacked_;
  bool damaged_ = false;
};

class RawlogRecording final : public Recording {
 public:
  RawlogRecording(const std::filesystem::path& file, const RecordingOptions& options)
      : name_(file.string()), whole_(is_whole(name_)), stream_(name_), given_(options.calibration) {
    given_.apply(calibration_);
    first_pass();
  }
  std::optional<Measurement> next_light() override {
    light_ = true;
    return next();
  }
  std::optional<Measurement> next() override {
    while (true) {
      if (auto measurement = buffer_.pop()) return measurement;
      if (done_) return std::nullopt;
      const auto object = stream_.next();
      if (!object) {
        done_ = true;
        buffer_.finish();
        if (!whole_ || stream_.damaged()) skips_.add("damaged end of file");
      } else if (const auto frame = std::dynamic_pointer_cast<obs::CSensoryFrame>(object)) {
        for (const auto& observation : *frame) convert(observation);
      } else if (const auto single = std::dynamic_pointer_cast<obs::CObservation>(object)) {
        convert(single);
      }
    }
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return skips_.counts(); }
  std::map<std::string, std::string> first_skipped() const override { return skips_.firsts(); }
  std::map<std::string, std::vector<Timestamp>> recorded_stamps() const override {
    return {{"odometry", track_.stamps()}};
  }
  std::vector<std::string> remarks() const override { return remarks_; }
  std::vector<Warning> warnings() const override { return warnings_; }

 private:
  void first_pass();
  void meet(const obs::CObservation::Ptr& observation);
  void convert(const obs::CObservation::Ptr& observation);
  void convert_scan(const obs::CObservation2DRangeScan& in, Timestamp stamp);
  void convert_depth(const obs::CObservation3DRangeScan& in, Timestamp stamp);
  void convert_stereo(const obs::CObservationStereoImages& in, Timestamp stamp);
  void push_frame(Measurement frame);

  std::string name_;
  bool whole_;
  ObjectStream stream_;
  CalibrationOverlay given_;
  Calibration calibration_;
  OdometryTrack track_;
  std::set<Timestamp> odometry_given_;
  ReorderBuffer buffer_;
  SkipCounts skips_;
  std::vector<std::string> remarks_;
  std::vector<Warning> warnings_;
  bool done_ = false;
  bool light_ = false;  // images are passed over
};

// Says where the scanner sits as soon as the log is opened: settings depend on it.
void RawlogRecording::meet(const obs::CObservation::Ptr& observation) {
  if (calibration_.lidar) return;
  const auto* scan = dynamic_cast<const obs::CObservation2DRangeScan*>(observation.get());
  if (scan != nullptr && to_stamp(scan->timestamp) && !is_empty(*scan)) {
    calibration_.lidar = to_lidar(*scan);
    given_.apply(*calibration_.lidar);
  }
}

// Odometry of the whole file: sums of actions, or observations as they are.
void RawlogRecording::first_pass() {
  ObjectStream objects(name_);
  std::vector<Odometry> samples;
  SE3 T_odom_body;
  bool any = false, usable = false;
  while (const auto object = objects.next()) {
    any = true;
    if (const auto actions = std::dynamic_pointer_cast<obs::CActionCollection>(object)) {
      if (const auto step = movement(*actions)) T_odom_body = T_odom_body * *step;
      remarks_.assign(1, "odometry: sums of the log's actions");
    } else if (const auto frame = std::dynamic_pointer_cast<obs::CSensoryFrame>(object)) {
      usable = usable || frame->size() > 0;
      for (const auto& observation : *frame) meet(observation);
      for (const auto& observation : *frame) {
        const auto stamp = to_stamp(observation->timestamp);
        if (!stamp || remarks_.empty()) continue;
        samples.push_back({*stamp, T_odom_body});
        break;
      }
    } else if (const auto odometry = std::dynamic_pointer_cast<obs::CObservationOdometry>(object)) {
      const auto& pose = odometry->odometry;
      const auto stamp = to_stamp(odometry->timestamp);
      if (stamp) samples.push_back({*stamp, SE3::planar(pose.x(), pose.y(), pose.phi())});
    } else if (const auto single = std::dynamic_pointer_cast<obs::CObservation>(object)) {
      usable = true;
      meet(single);
    }
  }
  if (!any) throw input_error(name_, "", "no MRPT object", "an MRPT rawlog");
  if (!usable) throw input_error(name_, "", "no observation", "an MRPT rawlog with sensor data");
  track_ = OdometryTrack(samples);
  skips_.add(kSkipTimeBack, static_cast<std::int64_t>(track_.dropped()));
  settle_planar(track_.trajectory(), given_.states("odometry.planar"), calibration_, remarks_,
                warnings_);
}

void RawlogRecording::push_frame(Measurement frame) {
  const Timestamp stamp = stamp_of(frame);
  if (odometry_given_.insert(stamp).second) {
    if (const auto odometry = track_.at(stamp)) buffer_.push(*odometry);
  }
  if (!buffer_.push(std::move(frame))) skips_.add(kSkipTimeBack);
}

void RawlogRecording::convert(const obs::CObservation::Ptr& observation) {
  if (std::dynamic_pointer_cast<obs::CObservationOdometry>(observation)) return;  // first pass
  const auto stamp = to_stamp(observation->timestamp);
  if (!stamp) {
    skips_.add("no time stamp");
    return;
  }
  try {
    if (const auto* scan = dynamic_cast<const obs::CObservation2DRangeScan*>(observation.get())) {
      convert_scan(*scan, *stamp);
    } else if (const auto* depth =
                   dynamic_cast<const obs::CObservation3DRangeScan*>(observation.get())) {
      if (!light_) convert_depth(*depth, *stamp);
    } else if (const auto* pair =
                   dynamic_cast<const obs::CObservationStereoImages*>(observation.get())) {
      if (!light_) convert_stereo(*pair, *stamp);
    } else {
      skips_.add(std::string("kind not used: ") + observation->GetRuntimeClass()->className);
    }
  } catch (const std::exception&) {
    skips_.add(kSkipBadImage);  // MRPT loads images late and throws then
  }
}

void RawlogRecording::convert_scan(const obs::CObservation2DRangeScan& in, Timestamp stamp) {
  if (is_empty(in)) {
    skips_.add("empty scan");
    return;
  }
  const std::size_t n = in.getScanSize();
  LaserScan scan;
  scan.stamp = stamp;
  // [MRPT]: beams spread over the aperture, first and last on its ends.
  const double step = static_cast<double>(in.aperture) / static_cast<double>(n - 1);
  if (beyond_one_turn(step, n)) {
    skips_.add(kSkipBeyondTurn, 1, in.sensorLabel + ": " + beyond_one_turn_text(step, n));
    return;
  }
  const double half = 0.5 * static_cast<double>(in.aperture);
  scan.angle_min = in.rightToLeft ? -half : half;
  scan.angle_increment = in.rightToLeft ? step : -step;
  scan.range_max = static_cast<double>(in.maxRange);
  scan.ranges.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const float r = in.getScanRange(i);
    scan.ranges[i] = in.getScanRangeValidity(i) && r < in.maxRange ? r : HUGE_VALF;
  }
  scan.lidar = to_lidar(in);
  given_.apply(scan.lidar);
  push_frame(std::move(scan));
}

void RawlogRecording::convert_depth(const obs::CObservation3DRangeScan& in, Timestamp stamp) {
  in.load();
  const int width = static_cast<int>(in.rangeImage.cols());
  const int height = static_cast<int>(in.rangeImage.rows());
  if (!in.hasRangeImage || width < 2 || height < 2 || !(in.rangeUnits > 0)) {
    skips_.add("no range image");
    return;
  }
  DepthFrame frame;
  frame.stamp = stamp;
  CameraModel camera = to_camera(in.cameraParams, width, height);
  if (!(camera.fx > 0) || !(camera.fy > 0)) {
    skips_.add("no intrinsics");
    return;
  }
  camera.T_body_camera = to_se3(in.sensorPose) * forward_looking_camera();  // MRPT: x forward
  frame.camera = {camera, 1.0 / static_cast<double>(in.rangeUnits), DepthNoise::kinect(camera.fx)};
  frame.raw.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      double raw = in.rangeImage(v, u);
      if (!in.range_is_depth) {  // distances along the ray
        const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
        raw /= std::sqrt(1 + x * x + y * y);
      }
      frame.raw[static_cast<std::size_t>(v * width + u)] =
          static_cast<std::uint16_t>(std::lround(raw));
    }
  }
  given_.apply(frame.camera);
  if (frame.camera.camera.width != width || frame.camera.camera.height != height) {
    skips_.add(kSkipWrongSize);
    return;
  }
  frame.raw = Rectifier(frame.camera.camera).depth(frame.raw);
  frame.camera.camera.distortion.reset();
  if (!calibration_.depth_camera) calibration_.depth_camera = frame.camera;
  push_frame(std::move(frame));
}

void RawlogRecording::convert_stereo(const obs::CObservationStereoImages& in, Timestamp stamp) {
  const auto to_grey = [](const mrpt::img::CImage& image) {
    const mrpt::img::CImage grey = image.grayscale();
    std::vector<std::uint8_t> pixels;
    for (unsigned v = 0; v < grey.getHeight(); ++v) {
      const auto* row = grey.ptrLine<std::uint8_t>(v);
      pixels.insert(pixels.end(), row, row + grey.getWidth());
    }
    return pixels;
  };
  const bool same = in.hasImageRight && in.imageLeft.getWidth() == in.imageRight.getWidth() &&
                    in.imageLeft.getHeight() == in.imageRight.getHeight();
  if (!same || in.rightCameraPose.x() <= 0) {
    skips_.add("stereo pair without a right image or baseline");
    return;
  }
  StereoFrame frame;
  frame.stamp = stamp;
  frame.camera.camera = to_camera(in.leftCamera, static_cast<int>(in.imageLeft.getWidth()),
                                  static_cast<int>(in.imageLeft.getHeight()));
  frame.camera.camera.T_body_camera = to_se3(mrpt::poses::CPose3D(in.cameraPose));
  frame.camera.baseline = in.rightCameraPose.x();
  given_.apply(frame.camera);
  const Rectifier rectifier(frame.camera.camera);
  frame.left = rectifier.grey(to_grey(in.imageLeft));
  frame.right = rectifier.grey(to_grey(in.imageRight));
  frame.camera.camera.distortion.reset();
  if (!calibration_.stereo_camera) calibration_.stereo_camera = frame.camera;
  push_frame(std::move(frame));
}
}  // namespace

std::unique_ptr<Recording> open_rawlog(const std::filesystem::path& file,
                                       const RecordingOptions& options) {
  return std::make_unique<RawlogRecording>(file, options);
}

}  // namespace lamina
