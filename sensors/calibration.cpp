// Reads calibration.yaml.
#include <lamina/sensors/calibration.hpp>

#include <Eigen/Geometry>
#include <cmath>
#include <sstream>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/intrinsics.hpp>
#include <lamina/sensors/text.hpp>
#include <lamina/sensors/yaml_section.hpp>

namespace lamina {
namespace {
constexpr double kQuaternionSlack = 0.05;     // further from unit length is a mistake, not rounding
constexpr double kQuaternionRounding = 1e-3;  // beyond this the reader is told
constexpr NumberRule kFocal{0, 1e6, false, "a focal length above 0 (px)"};
constexpr NumberRule kPrincipal{-1e5, 1e5, true, "a pixel coordinate"};
constexpr NumberRule kScale{0, 1e7, false, "raw units per metre, above 0"};
constexpr NumberRule kBaseline{0, 100, false, "a baseline above 0 (m)"};
constexpr NumberRule kDisparitySigma{0, 100, false, "a disparity sigma above 0 (px)"};
constexpr NumberRule kSigma{0, 1e3, false, "a sigma above 0"};

// The last three are of sensors that are not mapped with: read past.
const std::initializer_list<std::string_view> kSections = {
    "depth_camera", "stereo_camera", "lidar", "odometry", "imu", "gnss", "tags"};

SE3 read_pose(const YamlSection& parent, const std::string& key,
              std::vector<std::string>& remarks) {
  const YamlSection pose = parent.section(key);
  pose.check_keys({"translation", "rotation_xyzw"});
  const auto t = pose.numbers("translation", 3);
  const auto q = pose.numbers("rotation_xyzw", 4);
  if (!t) pose.fail("translation", "nothing", "a list of 3 numbers");
  if (!q) pose.fail("rotation_xyzw", "nothing", "a list of 4 numbers");
  Eigen::Quaterniond rotation((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1) <= kQuaternionSlack)) {
    std::ostringstream found;
    found << "a quaternion of length " << norm;
    pose.fail("rotation_xyzw", found.str(), "a unit quaternion x y z w");
  }
  if (std::abs(norm - 1) > kQuaternionRounding) {
    remarks.push_back(key + ": rotation_xyzw was scaled to unit length");
  }
  rotation.normalize();
  return {SO3(rotation), Eigen::Vector3d((*t)[0], (*t)[1], (*t)[2])};
}

// A section that may be laid over what is there already: then only what it states is taken.
struct Reading {
  const YamlSection& section;
  bool whole;  // what has no default must be stated

  void number(const char* key, const NumberRule& rule, double& value) const {
    if (whole || section.has(key)) value = section.number(key, rule);
  }
  void integer(const char* key, const NumberRule& rule, int& value) const {
    if (whole || section.has(key)) value = section.integer(key, rule);
  }
};

void read_camera(const Reading& reading, CameraModel& camera, std::vector<std::string>& remarks) {
  const YamlSection& section = reading.section;
  reading.integer("width", kImageSize, camera.width);
  reading.integer("height", kImageSize, camera.height);
  reading.number("fx", kFocal, camera.fx);
  reading.number("fy", kFocal, camera.fy);
  reading.number("cx", kPrincipal, camera.cx);
  reading.number("cy", kPrincipal, camera.cy);
  if (const auto d = section.numbers("distortion", 5)) {
    const bool any = std::any_of(d->begin(), d->end(), [](double x) { return x != 0; });
    camera.distortion.reset();
    if (any) camera.distortion = {(*d)[0], (*d)[1], (*d)[2], (*d)[3], (*d)[4]};
  }
  if (reading.whole || section.has("T_body_camera"))
    camera.T_body_camera = read_pose(section, "T_body_camera", remarks);
  const std::string wrong = reading.whole ? senseless_intrinsics(camera) : "";
  if (!wrong.empty()) section.fail("fx", wrong, "a field of view from 1 to 170 degrees");
  if (reading.whole &&
      (camera.cx < 0 || camera.cx > camera.width || camera.cy < 0 || camera.cy > camera.height)) {
    remarks.push_back("the principal point lies outside the image");
  }
}

const char* name_of(DepthNoise::Kind kind) {
  if (kind == DepthNoise::Kind::kStereo) return "stereo";
  return kind == DepthNoise::Kind::kIdeal ? "ideal" : "kinect";
}

// `before`: of the focal length and model that stood there.
void read_noise(const YamlSection& section, const std::string& model, double focal_before,
                DepthCamera& depth, std::vector<std::string>& remarks) {
  const double focal = depth.camera.fx;
  if (model != "stereo") {
    if (section.has("baseline") || section.has("disparity_sigma"))
      remarks.push_back("depth_camera: baseline and disparity_sigma count for model stereo only");
    depth.noise = model == "ideal" ? DepthNoise::ideal(focal) : DepthNoise::kinect(focal);
    return;
  }
  const bool was_stereo = depth.noise.kind == DepthNoise::Kind::kStereo && focal_before > 0;
  const double baseline = was_stereo && !section.has("baseline")
                              ? depth.noise.focal_baseline / focal_before
                              : section.number("baseline", kBaseline);
  const double sigma = section.number_or("disparity_sigma", kDisparitySigma,
                                         was_stereo ? depth.noise.disparity_sigma : 0.2);
  depth.noise = DepthNoise::stereo(focal, baseline, sigma);
}

void read_depth_camera(const Reading& reading, DepthCamera& depth,
                       std::vector<std::string>& remarks) {
  const YamlSection& section = reading.section;
  section.check_keys({"model", "width", "height", "fx", "fy", "cx", "cy", "depth_scale",
                      "distortion", "T_body_camera", "baseline", "disparity_sigma"});
  if (reading.whole && !section.has("model"))
    remarks.push_back("depth_camera.model: kinect was assumed");
  const std::string model =
      section.text_or("model", reading.whole ? "kinect" : name_of(depth.noise.kind));
  if (model != "kinect" && model != "stereo" && model != "ideal") {
    section.fail("model", shown(model), "kinect, stereo or ideal");
  }
  const double focal_before = depth.camera.fx;
  read_camera(reading, depth.camera, remarks);
  reading.number("depth_scale", kScale, depth.depth_scale);
  bool other_noise = reading.whole;
  for (const char* key : {"model", "fx", "baseline", "disparity_sigma"})
    other_noise = other_noise || section.has(key);
  if (other_noise) read_noise(section, model, focal_before, depth, remarks);
}

void read_stereo_camera(const Reading& reading, StereoCamera& stereo,
                        std::vector<std::string>& remarks) {
  const YamlSection& section = reading.section;
  section.check_keys({"width", "height", "fx", "fy", "cx", "cy", "distortion", "T_body_camera",
                      "baseline", "disparity_sigma"});
  read_camera(reading, stereo.camera, remarks);
  reading.number("baseline", kBaseline, stereo.baseline);
  stereo.disparity_sigma =
      section.number_or("disparity_sigma", kDisparitySigma, stereo.disparity_sigma);
}

void read_lidar(const Reading& reading, LidarModel& lidar, std::vector<std::string>& remarks) {
  const YamlSection& section = reading.section;
  section.check_keys({"range_sigma", "angle_sigma", "T_body_lidar"});
  lidar.noise.range_sigma = section.number_or("range_sigma", kSigma, lidar.noise.range_sigma);
  if (reading.whole && !section.has("range_sigma"))
    remarks.push_back("lidar.range_sigma: " + default_range_sigma() + " was assumed");
  lidar.noise.angle_sigma = section.number_or("angle_sigma", kSigma, lidar.noise.angle_sigma);
  if (section.has("T_body_lidar")) {
    lidar.T_body_lidar = read_pose(section, "T_body_lidar", remarks);
  } else if (reading.whole) {
    remarks.push_back("lidar.T_body_lidar: the body's origin was assumed");
  }
}

void read_odometry_model(const YamlSection& section, OdometryModel& model) {
  section.check_keys({"sigma_translation", "sigma_rotation", "sigma_rotation_turn", "planar"});
  model.sigma_translation = section.number_or("sigma_translation", kSigma, model.sigma_translation);
  model.sigma_rotation = section.number_or("sigma_rotation", kSigma, model.sigma_rotation);
  model.sigma_rotation_turn =
      section.number_or("sigma_rotation_turn", kSigma, model.sigma_rotation_turn);
  model.planar = section.boolean_or("planar", model.planar);
}

}  // namespace

SE3 forward_looking_camera() {
  return {SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), Eigen::Vector3d::Zero()};
}

Calibration parse_calibration(const std::string& text, const std::string& file) {
  const YamlSection root = YamlSection::parse(text, file);
  root.check_keys(kSections);
  Calibration result;
  if (root.has("depth_camera")) {
    read_depth_camera({root.section("depth_camera"), true}, result.depth_camera.emplace(),
                      result.remarks);
  }
  if (root.has("stereo_camera")) {
    read_stereo_camera({root.section("stereo_camera"), true}, result.stereo_camera.emplace(),
                       result.remarks);
  }
  if (root.has("lidar"))
    read_lidar({root.section("lidar"), true}, result.lidar.emplace(), result.remarks);
  if (root.has("odometry")) {
    read_odometry_model(root.section("odometry"), result.odometry);
    result.odometry_given = true;
  }
  return result;
}

Calibration read_calibration(const std::filesystem::path& file) {
  return parse_calibration(read_file_bytes(file), file.string());
}

std::string default_range_sigma() {
  std::ostringstream text;
  text << LidarNoise().range_sigma << " m";
  return text.str();
}

Warning place_assumed(const std::string& sensor, const std::string& why) {
  return {
      "mounting_assumed",
      sensor + " was placed at the body's origin, facing ahead (" + why +
          "): if it sits elsewhere, the path is that of the sensor, and odometry disagrees with "
          "it in turns; --calibration FILE states where it sits"};
}

CalibrationOverlay::CalibrationOverlay() = default;
CalibrationOverlay::~CalibrationOverlay() = default;
CalibrationOverlay::CalibrationOverlay(CalibrationOverlay&&) noexcept = default;
CalibrationOverlay& CalibrationOverlay::operator=(CalibrationOverlay&&) noexcept = default;

CalibrationOverlay::CalibrationOverlay(const std::filesystem::path& file)
    : root_(
          std::make_unique<YamlSection>(YamlSection::parse(read_file_bytes(file), file.string()))) {
  root_->check_keys(kSections);
  // What is wrong with it is said at once, whatever the recording holds.
  Calibration any;
  any.depth_camera.emplace().noise = DepthNoise::stereo(1, 1, 1);
  any.depth_camera->camera.fx = 1;
  any.stereo_camera.emplace();
  any.lidar.emplace();
  apply(any);
}

CalibrationOverlay::CalibrationOverlay(const std::optional<std::filesystem::path>& file) {
  if (file) *this = CalibrationOverlay(*file);
}

bool CalibrationOverlay::states(const std::string& key) const {
  if (!root_) return false;
  const auto dot = key.find('.');
  if (dot == std::string::npos) return root_->has(key);
  const std::string section = key.substr(0, dot);
  return root_->has(section) && root_->section(section).has(key.substr(dot + 1));
}

void CalibrationOverlay::apply(LidarModel& lidar) const {
  std::vector<std::string> remarks;
  if (states("lidar")) read_lidar({root_->section("lidar"), false}, lidar, remarks);
}

void CalibrationOverlay::apply(DepthCamera& depth) const {
  std::vector<std::string> remarks;
  if (states("depth_camera"))
    read_depth_camera({root_->section("depth_camera"), false}, depth, remarks);
}

void CalibrationOverlay::apply(StereoCamera& stereo) const {
  std::vector<std::string> remarks;
  if (states("stereo_camera"))
    read_stereo_camera({root_->section("stereo_camera"), false}, stereo, remarks);
}

void CalibrationOverlay::apply(OdometryModel& odometry) const {
  if (states("odometry")) read_odometry_model(root_->section("odometry"), odometry);
}

void CalibrationOverlay::apply(Calibration& calibration) const {
  if (calibration.depth_camera) apply(*calibration.depth_camera);
  if (calibration.stereo_camera) apply(*calibration.stereo_camera);
  if (calibration.lidar) apply(*calibration.lidar);
  apply(calibration.odometry);
  calibration.odometry_given = calibration.odometry_given || states("odometry");
}

}  // namespace lamina
