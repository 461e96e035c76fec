// Reads overrides and makes rigs of them.
#include <lamina/sim/settings.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <sstream>

#include <lamina/models/error.hpp>

namespace lamina::sim {
namespace {
constexpr double kDegree = 3.14159265358979323846 / 180;
}

std::string nearest_name(const std::string& word, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    std::vector<std::size_t> row(candidate.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= word.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i;
      for (std::size_t j = 1; j <= candidate.size(); ++j) {
        const std::size_t swap = diagonal + (word[i - 1] == candidate[j - 1] ? 0 : 1);
        diagonal = row[j];
        row[j] = std::min({swap, row[j] + 1, row[j - 1] + 1});
      }
    }
    if (row.back() < least) {
      least = row.back();
      best = candidate;
    }
  }
  return best;
}

const std::string* Settings::find(const std::string& key) {
  known_.insert(key);
  const auto it = parameters_.find(key);
  return it == parameters_.end() ? nullptr : &it->second;
}

double Settings::number(const std::string& key, double fallback) {
  const std::string* text = find(key);
  if (!text) {
    return fallback;
  }
  char* end = nullptr;
  const double value = std::strtod(text->c_str(), &end);
  if (text->empty() || *end != 0 || !std::isfinite(value)) {
    throw input_error("scene " + scene_, key, '"' + *text + '"', "a number");
  }
  require_in_range(key, value);
  return value;
}

// Sizes and rates no sensor can have.
void Settings::require_in_range(const std::string& key, double value) const {
  const std::string name = key.substr(key.find_last_of('.') + 1);
  double low = 0, high = 0;
  if (name == "rate_hz") low = 1e-3, high = 1e5;
  if (name == "width" || name == "height") low = 8, high = 16384;
  if (name == "beams") low = 2, high = 1e6;
  if (high == 0 || (value >= low && value <= high)) return;
  std::ostringstream range;
  range << "a number from " << low << " to " << high;
  throw input_error("scene " + scene_, key, '"' + parameters_.at(key) + '"', range.str());
}

int Settings::integer(const std::string& key, int fallback) {
  const double value = number(key, fallback);
  if (value != std::floor(value) || std::abs(value) > 1e9) {
    throw input_error("scene " + scene_, key, '"' + *find(key) + '"', "a whole number");
  }
  return static_cast<int>(value);
}

bool Settings::flag(const std::string& key, bool fallback) {
  const std::string word =
      choice(key, fallback ? "on" : "off", {"on", "off", "true", "false", "yes", "no", "1", "0"});
  return word == "on" || word == "true" || word == "yes" || word == "1";
}

std::string Settings::choice(const std::string& key, const std::string& fallback,
                             const std::vector<std::string>& choices) {
  const std::string* text = find(key);
  if (!text) {
    return fallback;
  }
  if (std::find(choices.begin(), choices.end(), *text) == choices.end()) {
    std::string all;
    for (const std::string& c : choices) {
      all += (all.empty() ? "" : ", ") + c;
    }
    throw input_error("scene " + scene_, key, '"' + *text + '"', "one of " + all);
  }
  return *text;
}

void Settings::finish() const {
  for (const auto& [key, value] : parameters_) {
    if (!known_.contains(key)) {
      const std::string hint = nearest_name(key, {known_.begin(), known_.end()});
      throw input_error("scene " + scene_, key, "a key this scene does not have",
                        hint.empty() ? "a key of docs/simulator.md for the sensors it has"
                                     : "a known one: did you mean '" + hint + "'?");
    }
  }
}

namespace {

DepthNoise make_depth_noise(Settings& s, const std::string& model, double fx) {
  const double baseline = s.number("camera.baseline_m", 0.12);
  const double sigma = s.number("camera.disparity_sigma_px", 0.2);
  DepthNoise noise = model == "kinect"   ? DepthNoise::kinect(fx)
                     : model == "stereo" ? DepthNoise::stereo(fx, baseline, sigma)
                                         : DepthNoise::ideal(fx);
  if (model == "kinect") {
    noise.min_range = 0.5;  // what the device gives out
    noise.max_range = 8;
  }
  noise.min_range = s.number("camera.min_range_m", noise.min_range);
  noise.max_range = s.number("camera.max_range_m", noise.max_range);
  noise.correlation_px = s.number("camera.correlation_px", noise.correlation_px);
  return noise;
}

void read_effects(Settings& s, const std::string& model, DepthEffects& e) {
  e.noise = s.flag("effects.noise", e.noise);
  e.correlated = s.flag("effects.correlated", e.correlated);
  e.quantise = s.flag("effects.quantise", e.quantise);
  e.lateral = s.flag("effects.lateral", model == "kinect");
  e.shadow = s.flag("effects.shadow", e.shadow);
  e.grazing = s.flag("effects.grazing", e.grazing);
  e.distortion = s.flag("effects.distortion", e.distortion);
  e.lateral_sigma_px = s.number("effects.lateral_sigma_px", e.lateral_sigma_px);
  e.grazing_deg = s.number("effects.grazing_deg", e.grazing_deg);
  e.distortion_sigma_px = s.number("effects.distortion_sigma_px", e.distortion_sigma_px);
  e.slope_px = s.number("effects.slope_px", e.slope_px);
  e.dropout = s.number("effects.dropout", e.dropout);
}

DepthSensor make_depth(Settings& s, const RigDefaults& d) {
  DepthSensor out;
  const SE3 mount =
      mount_camera({s.number("camera.forward_m", d.camera_forward), s.number("camera.left_m", 0),
                    s.number("camera.height_m", d.camera_height)},
                   s.number("camera.yaw_deg", 0) * kDegree,
                   s.number("camera.pitch_deg", d.camera_pitch_deg) * kDegree,
                   s.number("camera.roll_deg", 0) * kDegree);
  out.camera = kinect_camera(mount);
  CameraModel& c = out.camera.camera;
  c.width = s.integer("camera.width", c.width);
  c.height = s.integer("camera.height", c.height);
  const double scale = c.width / 640.0;
  c.fx = s.number("camera.fx", c.fx * scale);
  c.fy = s.number("camera.fy", c.fx);
  c.cx = s.number("camera.cx", 0.5 * (c.width - 1));
  c.cy = s.number("camera.cy", 0.5 * (c.height - 1));
  out.camera.depth_scale = s.number("camera.depth_scale", out.camera.depth_scale);
  const std::string model = s.choice("camera.model", d.camera_model, {"kinect", "stereo", "ideal"});
  out.camera.noise = make_depth_noise(s, model, c.fx);
  read_effects(s, model, out.effects);
  out.rate_hz = s.number("camera.rate_hz", d.camera_rate);
  out.delay_s = s.number("camera.delay_s", 0);
  return out;
}

StereoSensor make_stereo(Settings& s, const RigDefaults& d) {
  StereoSensor out;
  CameraModel& c = out.camera.camera;
  c.width = s.integer("stereo.width", 640);
  c.height = s.integer("stereo.height", 480);
  c.fx = c.fy = s.number("stereo.fx", 500);
  c.cx = 0.5 * (c.width - 1);
  c.cy = 0.5 * (c.height - 1);
  c.T_body_camera = mount_camera({s.number("stereo.forward_m", d.camera_forward), 0,
                                  s.number("stereo.height_m", d.camera_height)},
                                 0, s.number("stereo.pitch_deg", d.camera_pitch_deg) * kDegree, 0);
  out.camera.baseline = s.number("stereo.baseline_m", 0.12);
  out.camera.disparity_sigma = s.number("stereo.disparity_sigma_px", 0.25);
  out.pixel_noise = s.number("stereo.pixel_noise", out.pixel_noise);
  out.rate_hz = s.number("stereo.rate_hz", d.camera_rate);
  return out;
}

LidarSensor make_lidar(Settings& s, const RigDefaults& d) {
  LidarSensor out;
  out.model.T_body_lidar =
      SE3(SO3::rot_z(s.number("lidar.yaw_deg", d.lidar_yaw_deg) * kDegree) *
              SO3::rot_y(s.number("lidar.pitch_deg", d.lidar_pitch_deg) * kDegree) *
              SO3::rot_x(s.number("lidar.roll_deg", d.lidar_roll_deg) * kDegree),
          {s.number("lidar.forward_m", 0), 0, s.number("lidar.height_m", d.lidar_height)});
  out.model.noise.range_sigma = s.number("lidar.range_sigma_m", d.lidar_sigma);
  LidarGeometry& g = out.geometry;
  g.beams = s.integer("lidar.beams", d.lidar_beams);
  const double fov = s.number("lidar.fov_deg", d.lidar_fov_deg) * kDegree;
  g.angle_min = -0.5 * fov;
  g.angle_increment = fov / std::max(1, g.beams - 1);
  g.range_max = s.number("lidar.range_max_m", d.lidar_range);
  out.effects.noise = s.flag("lidar.noise", true);
  out.effects.mixed = s.flag("lidar.mixed", true);
  out.effects.grazing = s.flag("lidar.grazing", true);
  out.effects.dropout = s.number("lidar.dropout", out.effects.dropout);
  out.rate_hz = s.number("lidar.rate_hz", d.lidar_rate);
  out.sweep_s = s.number("lidar.sweep_s", 0);
  out.delay_s = s.number("lidar.delay_s", 0);
  return out;
}

OdometrySensor make_odometry(Settings& s, const RigDefaults& d) {
  OdometrySensor out;
  OdometryErrors& e = out.errors;
  e.noise = s.flag("odometry.noise", true);
  e.sigma_translation = s.number("odometry.sigma_translation", d.odometry_sigma);
  e.sigma_rotation = s.number("odometry.sigma_rotation", d.odometry_rotation);
  e.sigma_rotation_turn = s.number("odometry.sigma_rotation_turn", d.planar ? 0.02 : 0.005);
  e.scale = s.number("odometry.scale", d.odometry_scale);
  e.drift = s.number("odometry.drift_deg_per_m", d.odometry_drift_deg) * kDegree;
  e.planar = s.flag("odometry.planar", d.planar);
  OdometryFault slip;  // of a wheel
  slip.rotation_body.z() = s.number("odometry.slip_deg", 0) * kDegree;
  slip.time = s.number("odometry.slip_s", 10);
  if (slip.rotation_body.z() != 0) e.faults.push_back(slip);
  out.rate_hz = s.number("odometry.rate_hz", d.odometry_rate);
  return out;
}

// The sensor when its key says so. One that the caller switched off is read all the same: its other
// keys stay valid, so that one line turns it on and off.
template <class Make>
auto when_enabled(Settings& s, const std::string& key, bool fallback, Make make)
    -> std::optional<decltype(make())> {
  const bool on = s.flag(key, fallback);
  if (!on && !s.given(key)) return std::nullopt;
  auto sensor = make();
  if (!on) return std::nullopt;
  return sensor;
}

}  // namespace

Rig make_rig(Settings& s, const RigDefaults& d) {
  Rig rig;
  rig.depth = when_enabled(s, "camera.enabled", d.depth, [&] { return make_depth(s, d); });
  rig.stereo = when_enabled(s, "stereo.enabled", d.stereo, [&] { return make_stereo(s, d); });
  rig.lidar = when_enabled(s, "lidar.enabled", d.lidar, [&] { return make_lidar(s, d); });
  rig.odometry = when_enabled(s, "odometry.enabled", d.odometry, [&] {
    const OdometrySensor sensor = make_odometry(s, d);
    const OdometryErrors& e = sensor.errors;
    // What a maker's sheet would say: the random part, and a little for the systematic part.
    rig.assumed_odometry.sigma_translation =
        s.number("odometry.believed_sigma_translation", std::max(0.01, 1.5 * e.sigma_translation));
    rig.assumed_odometry.sigma_rotation =
        s.number("odometry.believed_sigma_rotation", std::max(0.002, 1.5 * e.sigma_rotation));
    rig.assumed_odometry.planar = e.planar;
    return sensor;
  });
  if (!rig.odometry) rig.assumed_odometry = {};
  rig.accelerometer = when_enabled(s, "accelerometer.enabled", d.accelerometer, [&] {
    return AccelerometerSensor{s.number("accelerometer.sigma", 0.05),
                               s.number("accelerometer.rate_hz", 50)};
  });
  rig.mounting_error.rotation_deg = {s.number("calibration.error_roll_deg", 0),
                                     s.number("calibration.error_pitch_deg", 0),
                                     s.number("calibration.error_yaw_deg", 0)};
  rig.mounting_error.translation_cm = {s.number("calibration.error_x_cm", 0),
                                       s.number("calibration.error_y_cm", 0),
                                       s.number("calibration.error_z_cm", 0)};
  rig.focal_error = s.number("calibration.error_focal_percent", 0) / 100;
  return rig;
}

Parameters parse_parameters(const std::vector<std::string>& assignments) {
  Parameters parameters;
  for (const auto& assignment : assignments) {
    const auto equals = assignment.find('=');
    if (equals == std::string::npos) {
      throw Error("--set: found '" + assignment + "', expected key=value");
    }
    parameters[assignment.substr(0, equals)] = assignment.substr(equals + 1);
  }
  return parameters;
}

}  // namespace lamina::sim
