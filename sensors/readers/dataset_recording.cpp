// A dataset folder (TUM RGB-D layout and more) as a recording.
#include <lamina/sensors/readers/dataset_recording.hpp>

#include <algorithm>
#include <array>
#include <fstream>
#include <set>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/depth_codes.hpp>
#include <lamina/sensors/intrinsics.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/readers/image_file.hpp>
#include <lamina/sensors/readers/odometry_frame.hpp>
#include <lamina/sensors/readers/planar_odometry.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/readers/repeated_images.hpp>
#include <lamina/sensors/readers/text_streams.hpp>
#include <lamina/sensors/rectify.hpp>
#include <lamina/sensors/scan_stream.hpp>
#include <lamina/sensors/text.hpp>
#include <lamina/sensors/time_order.hpp>

namespace lamina {
namespace {
// The folder's own, and what --calibration states over it; that alone where the folder has none.
Calibration calibration_of(const std::filesystem::path& folder, const RecordingOptions& options) {
  const auto own = folder / "calibration.yaml";
  if (options.calibration && !std::filesystem::exists(own))
    return read_calibration(*options.calibration);
  Calibration calibration = read_calibration(own);
  CalibrationOverlay(options.calibration).apply(calibration);
  return calibration;
}

// Whether either of the two has the key odometry.planar.
bool states_planar(const std::filesystem::path& folder, const RecordingOptions& options) {
  const auto own = folder / "calibration.yaml";
  return CalibrationOverlay(options.calibration).states("odometry.planar") ||
         (std::filesystem::exists(own) && CalibrationOverlay(own).states("odometry.planar"));
}

}  // namespace

DatasetRecording::DatasetRecording(const std::filesystem::path& folder,
                                   const RecordingOptions& options)
    : folder_(folder),
      calibration_(calibration_of(folder, options)),
      planar_stated_(states_planar(folder, options)) {
  remarks_ = calibration_.remarks;
  read_poses();
  read_scans();
  read_depth_list(options);
  read_stereo_lists(options);
  schedule();
  warn_of_empty_files();
  count_unused();
}

// A file that is there states that its sensor was aboard.
void DatasetRecording::warn_of_empty_files() {
  const auto check = [&](const char* name, bool empty) {
    if (!empty || !has(name)) return;
    take({{"empty_file", std::string(name) + " holds no usable line: mapped without it"}}, {}, {});
  };
  check("odometry.txt", track_.empty());
  check("scans.csv", scans_.empty());
  check("depth.txt", depth_.empty());
  check("left.txt", stereo_.empty());
}

// What was done about a file; of one cause, the files are in one warning.
void DatasetRecording::take(const std::vector<Warning>& warnings,
                            const std::vector<std::string>& remarks,
                            const std::map<Timestamp, Timestamp>& recorded) {
  add_warnings(warnings_, warnings);
  remarks_.insert(remarks_.end(), remarks.begin(), remarks.end());
  restamped_.insert(recorded.begin(), recorded.end());
}

std::map<Timestamp, Timestamp> DatasetRecording::restamped() const {
  std::vector<Timestamp> frames;
  for (const Item& item : items_) {
    if (item.stream > Stream::kOdometry) frames.push_back(item.stamp);
  }
  return where_increasing(restamped_, frames);
}

void DatasetRecording::read_poses() {
  if (has("odometry.txt")) {
    StreamClock clock{"odometry.txt", {}, {}, {}};
    odometry_ = parse_odometry(text("odometry.txt"), skips_, &clock);
    take(clock.warnings, clock.remarks, {});
    const auto& camera = calibration_.depth_camera;
    take(mend_odometry_frame(odometry_,
                             camera ? std::optional(camera->camera.T_body_camera) : std::nullopt),
         {}, {});
    track_ = OdometryTrack(odometry_);
    settle_planar(track_.trajectory(), planar_stated_, calibration_, remarks_, warnings_);
  }
  if (has("accelerometer.txt")) {
    accelerometer_ = parse_accelerometer(text("accelerometer.txt"), skips_);
  }
}

// Streams of the layout that nothing is mapped with.
void DatasetRecording::count_unused() {
  skips_.set_source("");
  for (const char* name : {"imu.txt", "gnss.txt", "altimeter.txt", "tags.csv", "priors.txt"})
    skips_.add("stream not used", has(name) ? 1 : 0, name);
}

void DatasetRecording::read_scans() {
  if (!has("scans.csv")) return;
  const std::string all = text("scans.csv");
  for (const ScanLine& scan : index_scans(all, skips_, stream_))
    scans_.push_back({scan.stamp, scan.line.data() - all.data(), scan.line.size(), scan.number});
  take(stream_.notes().warnings, stream_.notes().remarks, stream_.restamped());
  scans_file_.open(folder_ / "scans.csv", std::ios::binary);
  if (!calibration_.lidar) {
    calibration_.lidar = LidarModel();
    calibration_.remarks.push_back("lidar: not in calibration.yaml: the body's origin was assumed");
  }
  const auto assumed =
      std::find_if(calibration_.remarks.begin(), calibration_.remarks.end(), [](const auto& text) {
        return text.find("lidar") == 0 && text.find("origin was assumed") != std::string::npos;
      });
  if (assumed != calibration_.remarks.end() && !track_.empty())
    warnings_.push_back(place_assumed("the scanner", *assumed));
}

void DatasetRecording::fail_missing_section(const char* section, const char* file) const {
  throw input_error((folder_ / "calibration.yaml").string(), section, "nothing",
                    std::string("the camera of ") + file);
}

// The entries of a list whose files exist; the others are counted.
std::vector<ListEntry> DatasetRecording::read_list(const char* name, StreamClock* clock) {
  std::int64_t repeats = 0;
  const std::string lines = without_repeated_images(text(name), folder_, repeats);
  if (repeats > 0)
    remarks_.push_back(std::string(name) + ": " + std::to_string(repeats) +
                       " images are listed twice with one stamp: each is read once");
  std::vector<ListEntry> entries = parse_list(lines, skips_, clock);
  const auto absent = [&](const ListEntry& entry) {
    std::error_code error;
    return !std::filesystem::is_regular_file(folder_ / entry.path, error);
  };
  const auto first = std::find_if(entries.begin(), entries.end(), absent);
  const std::string where = first == entries.end() ? "" : " '" + first->path + "'";
  skips_.add(kSkipMissingFile, static_cast<std::int64_t>(std::erase_if(entries, absent)), where);
  return entries;
}

// A calibration of images of another size, but the same shape, holds for these all the same. What
// cannot be a principal point is none.
void DatasetRecording::fit_to_images(const std::string& path, const char* section,
                                     CameraModel& camera) {
  const auto size = image_size(folder_ / path);
  if (auto mended = mend_principal_point(camera, std::string("calibration.yaml: ") + section))
    warnings_.push_back(*std::move(mended));
  if (!size || (size->first == camera.width && size->second == camera.height)) return;
  CameraModel scaled = camera;
  std::tie(scaled.width, scaled.height) = *size;
  if (!scale_intrinsics(scaled, camera.width, camera.height)) return;
  warnings_.push_back(
      {"image_size", std::string("calibration.yaml: ") + section + " is of " +
                         std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                         " pixels, images have " + std::to_string(scaled.width) + " x " +
                         std::to_string(scaled.height) + ": fx, fy, cx, cy scaled to these"});
  camera = scaled;
}

void DatasetRecording::read_depth_list(const RecordingOptions& options) {
  if (!has("depth.txt")) return;
  if (!calibration_.depth_camera) fail_missing_section("depth_camera", "depth.txt");
  StreamClock clock{"depth.txt", {}, {}, {}};
  depth_ = read_list("depth.txt", &clock);
  take(clock.warnings, clock.remarks, clock.recorded);
  if (!depth_.empty()) {
    DepthCamera& depth = *calibration_.depth_camera;
    const double stated = depth.camera.fx;
    fit_to_images(depth_[0].path, "depth_camera", depth.camera);
    depth.noise = noise_at_focal(depth.noise, depth.camera.fx / stated);
  }
  depth_rectifier_.emplace(calibration_.depth_camera->camera);
  if (!has("rgb.txt")) return;
  SkipCounts colour;  // colour is no measurement: what it lacks is only remarked
  std::vector<Timestamp> depth_stamps;
  for (const ListEntry& entry : depth_) depth_stamps.push_back(entry.stamp);
  for (const ListEntry& entry : parse_list(text("rgb.txt"), colour)) {
    colour_stamps_.push_back(entry.stamp);
  }
  const auto pairs =
      associate_by_time(depth_stamps, colour_stamps_, options.association_tolerance_s);
  const auto paired = std::count_if(pairs.begin(), pairs.end(), [](auto i) { return i >= 0; });
  remarks_.push_back("rgb.txt: " + std::to_string(colour_stamps_.size()) + " images, " +
                     std::to_string(paired) + " with a depth image within tolerance");
}

void DatasetRecording::read_stereo_lists(const RecordingOptions& options) {
  if (!has("left.txt") && !has("right.txt")) return;
  for (const char* name : {"left.txt", "right.txt"}) {
    if (!has(name)) {
      throw input_error((folder_ / name).string(), "", "no such file",
                        "both left.txt and right.txt");
    }
  }
  if (!calibration_.stereo_camera) fail_missing_section("stereo_camera", "left.txt");
  const std::vector<ListEntry> left = read_list("left.txt"), right = read_list("right.txt");
  if (!left.empty()) {
    fit_to_images(left[0].path, "stereo_camera", calibration_.stereo_camera->camera);
  }
  stereo_rectifier_.emplace(calibration_.stereo_camera->camera);
  std::vector<Timestamp> left_stamps, right_stamps;
  for (const ListEntry& entry : left) left_stamps.push_back(entry.stamp);
  for (const ListEntry& entry : right) right_stamps.push_back(entry.stamp);
  const auto pairs = associate_by_time(left_stamps, right_stamps, options.association_tolerance_s);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i] < 0) continue;
    stereo_.push_back({left[i], right[static_cast<std::size_t>(pairs[i])]});
  }
  skips_.add(kSkipNoPartner,
             static_cast<std::int64_t>(left.size() + right.size() - 2 * stereo_.size()));
}

void DatasetRecording::schedule() {
  const auto add = [&](Stream stream, std::size_t index, Timestamp stamp) {
    items_.push_back({stamp, stream, index});
  };
  std::set<Timestamp> odometry_stamps;
  for (std::size_t i = 0; i < odometry_.size(); ++i) {
    add(Stream::kOdometry, i, odometry_[i].stamp);
    odometry_stamps.insert(odometry_[i].stamp);
  }
  // A frame between odometry samples gets its own, so that whoever reads in order has both.
  const auto add_frame = [&](Stream stream, std::size_t index, Timestamp stamp) {
    expects_frames_ = true;
    add(stream, index, stamp);
    if (!odometry_stamps.insert(stamp).second) return;
    if (const auto between = track_.at(stamp)) {
      odometry_.push_back(*between);
      add(Stream::kOdometry, odometry_.size() - 1, stamp);
    }
  };
  for (std::size_t i = 0; i < accelerometer_.size(); ++i) {
    add(Stream::kAccelerometer, i, accelerometer_[i].stamp);
  }
  for (std::size_t i = 0; i < scans_.size(); ++i) add_frame(Stream::kScan, i, scans_[i].stamp);
  for (std::size_t i = 0; i < depth_.size(); ++i) add_frame(Stream::kDepth, i, depth_[i].stamp);
  for (std::size_t i = 0; i < stereo_.size(); ++i) {
    add_frame(Stream::kStereo, i, stereo_[i][0].stamp);
  }
  std::stable_sort(items_.begin(), items_.end(), [](const Item& a, const Item& b) {
    return std::tie(a.stamp, a.stream) < std::tie(b.stamp, b.stream);
  });
  if (!expects_frames_) fail_nothing_usable();
}

void DatasetRecording::fail_nothing_usable() const {
  // The first case of each reason tells more than their number.
  std::string found = "nothing usable";
  for (const auto& [why, count] : skips_.counts()) {
    found += (found.size() > 14 ? ", " : " (") + std::to_string(count) + " x " + why;
    if (!skips_.first(why).empty()) found += ", first " + skips_.first(why);
  }
  if (skips_.total() > 0) found += ")";
  throw input_error(folder_.string(), "", found,
                    "depth.txt, left.txt and right.txt, or scans.csv with what they list");
}

std::optional<Measurement> DatasetRecording::read(const Item& item) {
  switch (item.stream) {
    case Stream::kAccelerometer:
      return accelerometer_[item.index];
    case Stream::kOdometry:
      return odometry_[item.index];
    case Stream::kScan:
      return read_scan(scans_[item.index]);
    case Stream::kDepth:
      return read_depth(depth_[item.index]);
    case Stream::kStereo:
      return read_stereo(item.index);
  }
  return std::nullopt;
}

void DatasetRecording::skip_image(const std::string& path, const std::string& why,
                                  const CameraModel& camera) {
  skips_.set_source("");
  skips_.add(why, 1,
             path + ": " + image_facts(folder_ / path) + ", calibration.yaml has " +
                 std::to_string(camera.width) + " x " + std::to_string(camera.height));
}

std::optional<Measurement> DatasetRecording::read_depth(const ListEntry& entry) {
  const DepthCamera& camera = *calibration_.depth_camera;
  std::string why;
  auto image =
      read_depth_image(folder_ / entry.path, camera.camera.width, camera.camera.height, why);
  if (!image) {
    skip_image(entry.path, why, camera.camera);
    return std::nullopt;
  }
  DepthFrame frame{entry.stamp, camera, std::move(image->pixels)};
  saturated_.drop(frame.raw);
  if (depth_rectifier_->needed()) {
    frame.raw = depth_rectifier_->depth(frame.raw);
    frame.camera.camera.distortion.reset();
  }
  return frame;
}

std::optional<Measurement> DatasetRecording::read_stereo(std::size_t index) {
  const StereoCamera& camera = *calibration_.stereo_camera;
  StereoFrame frame;
  frame.stamp = stereo_[index][0].stamp;
  frame.camera = camera;
  frame.camera.camera.distortion.reset();
  std::string why;
  for (const bool right : {false, true}) {
    auto image = read_grey_image(folder_ / stereo_[index][right].path, camera.camera.width,
                                 camera.camera.height, why);
    if (!image) {
      skip_image(stereo_[index][right].path, why, camera.camera);
      return std::nullopt;
    }
    (right ? frame.right : frame.left) = stereo_rectifier_->grey(image->pixels);
  }
  return frame;
}

std::optional<Measurement> DatasetRecording::read_scan(const ScanPlace& place) {
  std::string line(place.size, '\0'), why, found;
  scans_file_.clear();
  scans_file_.seekg(place.begin);
  if (!scans_file_.read(line.data(), static_cast<std::streamsize>(line.size()))) {
    throw input_error((folder_ / "scans.csv").string(), "byte " + std::to_string(place.begin),
                      "nothing that could be read", "the scan that stood there");
  }
  auto scan = parse_scan_line(line, why, &found);
  if (!scan) {
    skips_.set_source("scans.csv:");
    skips_.add(why, 1, std::to_string(place.number) + ": " + (found.empty() ? shown(line) : found));
    return std::nullopt;
  }
  scan->stamp = place.stamp;
  stream_.correct(*scan);
  scan->lidar = *calibration_.lidar;
  return *std::move(scan);
}

std::unique_ptr<Recording> open_dataset_folder(const std::filesystem::path& folder,
                                               const RecordingOptions& options) {
  return std::make_unique<DatasetRecording>(folder, options);
}

}  // namespace lamina
