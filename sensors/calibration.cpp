// Reads calibration.yaml.
#include <lamina/sensors/calibration.hpp>

#include <Eigen/Geometry>
#include <cmath>
#include <sstream>

#include <lamina/models/error.hpp>
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

CameraModel read_camera(const YamlSection& section, std::vector<std::string>& remarks) {
  CameraModel camera;
  camera.width = section.integer("width", kImageSize);
  camera.height = section.integer("height", kImageSize);
  camera.fx = section.number("fx", kFocal);
  camera.fy = section.number("fy", kFocal);
  camera.cx = section.number("cx", kPrincipal);
  camera.cy = section.number("cy", kPrincipal);
  if (const auto d = section.numbers("distortion", 5)) {
    const bool any = std::any_of(d->begin(), d->end(), [](double x) { return x != 0; });
    if (any) camera.distortion = {(*d)[0], (*d)[1], (*d)[2], (*d)[3], (*d)[4]};
  }
  camera.T_body_camera = read_pose(section, "T_body_camera", remarks);
  if (camera.cx < 0 || camera.cx > camera.width || camera.cy < 0 || camera.cy > camera.height) {
    remarks.push_back("the principal point lies outside the image");
  }
  return camera;
}

DepthCamera read_depth_camera(const YamlSection& section, std::vector<std::string>& remarks) {
  section.check_keys({"model", "width", "height", "fx", "fy", "cx", "cy", "depth_scale",
                      "distortion", "T_body_camera", "baseline", "disparity_sigma"});
  DepthCamera depth;
  if (!section.has("model")) remarks.push_back("depth_camera.model: kinect was assumed");
  const std::string model = section.text_or("model", "kinect");
  if (model != "kinect" && model != "stereo" && model != "ideal") {
    section.fail("model", shown(model), "kinect, stereo or ideal");
  }
  depth.camera = read_camera(section, remarks);
  depth.depth_scale = section.number("depth_scale", kScale);
  if (model == "kinect") depth.noise = DepthNoise::kinect(depth.camera.fx);
  if (model == "ideal") depth.noise = DepthNoise::ideal(depth.camera.fx);
  if (model == "stereo") {
    const double baseline = section.number("baseline", kBaseline);
    const double sigma = section.number_or("disparity_sigma", kDisparitySigma, 0.2);
    depth.noise = DepthNoise::stereo(depth.camera.fx, baseline, sigma);
  } else if (section.has("baseline") || section.has("disparity_sigma")) {
    remarks.push_back("depth_camera: baseline and disparity_sigma count for model stereo only");
  }
  return depth;
}

StereoCamera read_stereo_camera(const YamlSection& section, std::vector<std::string>& remarks) {
  section.check_keys({"width", "height", "fx", "fy", "cx", "cy", "distortion", "T_body_camera",
                      "baseline", "disparity_sigma"});
  StereoCamera stereo;
  stereo.camera = read_camera(section, remarks);
  stereo.baseline = section.number("baseline", kBaseline);
  stereo.disparity_sigma = section.number_or("disparity_sigma", kDisparitySigma, 0.25);
  return stereo;
}

LidarModel read_lidar(const YamlSection& section, std::vector<std::string>& remarks) {
  section.check_keys({"range_sigma", "angle_sigma", "T_body_lidar"});
  LidarModel lidar;
  lidar.noise.range_sigma = section.number_or("range_sigma", kSigma, lidar.noise.range_sigma);
  lidar.noise.angle_sigma = section.number_or("angle_sigma", kSigma, lidar.noise.angle_sigma);
  if (section.has("T_body_lidar")) {
    lidar.T_body_lidar = read_pose(section, "T_body_lidar", remarks);
  } else {
    remarks.push_back("lidar.T_body_lidar: the body's origin was assumed");
  }
  return lidar;
}

OdometryModel read_odometry_model(const YamlSection& section) {
  section.check_keys({"sigma_translation", "sigma_rotation", "sigma_rotation_turn", "planar"});
  OdometryModel model;
  model.sigma_translation = section.number_or("sigma_translation", kSigma, model.sigma_translation);
  model.sigma_rotation = section.number_or("sigma_rotation", kSigma, model.sigma_rotation);
  model.sigma_rotation_turn =
      section.number_or("sigma_rotation_turn", kSigma, model.sigma_rotation_turn);
  model.planar = section.boolean_or("planar", model.planar);
  return model;
}
}  // namespace

SE3 forward_looking_camera() {
  return {SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), Eigen::Vector3d::Zero()};
}

Calibration parse_calibration(const std::string& text, const std::string& file) {
  const YamlSection root = YamlSection::parse(text, file);
  root.check_keys({"depth_camera", "stereo_camera", "lidar", "odometry"});
  Calibration result;
  if (root.has("depth_camera")) {
    result.depth_camera = read_depth_camera(root.section("depth_camera"), result.remarks);
  }
  if (root.has("stereo_camera")) {
    result.stereo_camera = read_stereo_camera(root.section("stereo_camera"), result.remarks);
  }
  if (root.has("lidar")) result.lidar = read_lidar(root.section("lidar"), result.remarks);
  if (root.has("odometry")) {
    result.odometry = read_odometry_model(root.section("odometry"));
    result.odometry_given = true;
  }
  return result;
}

Calibration read_calibration(const std::filesystem::path& file) {
  return parse_calibration(read_file_bytes(file), file.string());
}

}  // namespace lamina
