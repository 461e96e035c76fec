// Drives a world and writes what it measures.
#include <lamina/sim/dataset.hpp>

#include <cstdio>
#include <fstream>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/png_image.hpp>
#include <lamina/sim/grey_png.hpp>
#include <lamina/sim/truth.hpp>

namespace lamina::sim {
namespace {

namespace fs = std::filesystem;

std::string pose_line(Timestamp stamp, const SE3& T) {
  const Eigen::Vector4d& q = T.so3().quaternion().coeffs();
  const Eigen::Vector3d& t = T.translation();
  char text[240];
  std::snprintf(text, sizeof text, "%s %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                stamp.to_string().c_str(), t.x(), t.y(), t.z(), q[0], q[1], q[2], q[3]);
  return text;
}

std::string scan_line(const LaserScan& scan) {
  char text[160];
  std::snprintf(text, sizeof text, "%s,%.10g,%.10g,%g,%g", scan.stamp.to_string().c_str(),
                scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max);
  std::string line = text;
  for (float range : scan.ranges) {
    std::snprintf(text, sizeof text, range > 0 ? ",%.4f" : ",0", static_cast<double>(range));
    line += text;
  }
  return line + "\n";
}

/// Streams of one dataset folder; each file appears with its first line.
class Writer {
 public:
  Writer(fs::path folder, bool labels) : folder_(std::move(folder)), labels_(labels) {
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error || !fs::is_directory(folder_)) {
      throw input_error(folder_.string(), "", "a folder that cannot be made", "a writable place");
    }
    clear();
  }

  void record_as(DatasetFormat format, const Calibration& calibration) {
    if (format == DatasetFormat::kFolder) return;
    bag_ = std::make_unique<BagWriter>(make_dataset_sink(folder_, format), calibration);
  }

  void write(const DepthFrame& frame, const Simulation& simulation) {
    const std::string name = frame.stamp.to_string() + ".png";
    if (bag_) bag_->write(frame);
    if (!bag_) {
      image("depth", name, {frame.width(), frame.height(), frame.raw});
      line("depth.txt", "# timestamp filename\n",
           frame.stamp.to_string() + " depth/" + name + "\n");
    }
    if (labels_) {
      DepthImage labels{frame.width(), frame.height(), {}};
      for (std::int32_t surface : simulation.depth_truth().surface) {
        labels.pixels.push_back(
            static_cast<std::uint16_t>(simulation.caster().plane_of(surface) + 1));
      }
      image("labels", name, labels);
      line("labels.txt", "# timestamp filename; pixel = plane id + 1, 0 = none\n",
           frame.stamp.to_string() + " labels/" + name + "\n");
    }
    ++counts_.depth_frames;
  }
  void write(const StereoFrame& pair, const Simulation&) {
    if (bag_) throw Error("simulate: found stereo pairs, expected --format folder for them");
    const std::string name = pair.stamp.to_string() + ".png";
    const CameraModel& c = pair.camera.camera;
    for (const char* side : {"left", "right"}) {
      const std::string s = side;
      fs::create_directories(folder_ / s);
      write_grey_png(folder_ / s / name, c.width, c.height, s == "left" ? pair.left : pair.right);
      line(s + ".txt", "# timestamp filename\n",
           pair.stamp.to_string() + " " + s + "/" + name + "\n");
    }
    ++counts_.stereo_pairs;
  }
  void write(const LaserScan& scan, const Simulation&) {
    ++counts_.scans;
    if (bag_) return bag_->write(scan);
    line("scans.csv", "# timestamp,angle_min,angle_increment,range_min,range_max,r0,r1,...\n",
         scan_line(scan));
  }
  void write(const Odometry& odometry, const Simulation&) {
    ++counts_.odometry;
    if (bag_) return bag_->write(odometry);
    line("odometry.txt", "# timestamp tx ty tz qx qy qz qw\n",
         pose_line(odometry.stamp, odometry.T_odom_body));
  }
  void write(const Accelerometer& a, const Simulation&) {
    ++counts_.accelerometer;
    if (bag_) return bag_->write(a);
    char text[120];
    std::snprintf(text, sizeof text, "%s %.6f %.6f %.6f\n", a.stamp.to_string().c_str(),
                  a.acceleration_body.x(), a.acceleration_body.y(), a.acceleration_body.z());
    line("accelerometer.txt", "# timestamp ax ay az\n", text);
  }
  void write(const CloudFrame&, const Simulation&) { LAMINA_CHECK(false); }

  void line(const std::string& file, const std::string& head, const std::string& text) {
    auto [it, fresh] = files_.try_emplace(file);
    if (fresh) {
      it->second.open(folder_ / file, std::ios::binary);
      it->second << head;
    }
    it->second << text;
    if (!it->second) {
      throw input_error((folder_ / file).string(), "", "a file that cannot be written",
                        "a writable folder");
    }
  }
  void close() {
    if (bag_) bag_->close();
    for (auto& [name, file] : files_) {
      file.close();
      if (!file) {
        throw input_error((folder_ / name).string(), "", "a full disk or a lost folder", "room");
      }
    }
  }
  const DatasetCounts& counts() const { return counts_; }

 private:
  // An earlier world of ours may be written over, all its streams go; a recording may not.
  void clear() const {
    std::string first;
    std::ifstream calibration(folder_ / "calibration.yaml");
    std::getline(calibration, first);
    const bool ours = first.rfind("# scene ", 0) == 0;
    calibration.close();
    for (const char* file : {"calibration.yaml", "depth.txt", "labels.txt", "left.txt", "right.txt",
                             "scans.csv", "odometry.txt", "accelerometer.txt", "groundtruth.txt"}) {
      if (!fs::exists(folder_ / file)) continue;
      if (!ours) {
        throw input_error((folder_ / file).string(), "", "a recording that was not simulated",
                          "another folder");
      }
      fs::remove(folder_ / file);
    }
    if (!ours) return;
    fs::remove(folder_ / "recording.bag");
    fs::remove_all(folder_ / "recording");
  }

  void image(const std::string& folder, const std::string& name, const DepthImage& pixels) {
    fs::create_directories(folder_ / folder);
    const std::string bytes = encode_png_depth(pixels);
    std::ofstream out(folder_ / folder / name, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!out.flush()) {
      throw input_error((folder_ / folder / name).string(), "", "a file that cannot be written",
                        "a writable folder");
    }
  }

  fs::path folder_;
  bool labels_;
  std::unique_ptr<BagWriter> bag_;
  std::map<std::string, std::ofstream> files_;
  DatasetCounts counts_;
};

std::string yaml_pose(const SE3& T) {
  const Eigen::Vector4d& q = T.so3().quaternion().coeffs();
  const Eigen::Vector3d& t = T.translation();
  char text[240];
  std::snprintf(text, sizeof text,
                "{translation: [%.9g, %.9g, %.9g], rotation_xyzw: [%.12g, %.12g, %.12g, %.12g]}",
                t.x(), t.y(), t.z(), q[0], q[1], q[2], q[3]);
  return text;
}

std::string yaml_camera(const CameraModel& c) {
  char text[240];
  std::snprintf(text, sizeof text,
                "  width: %d\n  height: %d\n  fx: %.10g\n  fy: %.10g\n  cx: %.10g\n  cy: %.10g\n",
                c.width, c.height, c.fx, c.fy, c.cx, c.cy);
  return text + ("  T_body_camera: " + yaml_pose(c.T_body_camera)) + "\n";
}

std::string entry(const char* key, double value) {
  char text[80];
  std::snprintf(text, sizeof text, "  %s: %.10g\n", key, value);
  return text;
}

}  // namespace

std::string to_yaml(const Calibration& calibration) {
  std::string out;
  if (const auto& depth = calibration.depth_camera) {
    const DepthNoise& noise = depth->noise;
    const char* model = noise.kind == DepthNoise::Kind::kKinect   ? "kinect"
                        : noise.kind == DepthNoise::Kind::kStereo ? "stereo"
                                                                  : "ideal";
    out += "depth_camera:\n  model: " + std::string(model) + "\n" + yaml_camera(depth->camera) +
           entry("depth_scale", depth->depth_scale);
    if (noise.kind == DepthNoise::Kind::kStereo) {
      out += entry("baseline", noise.focal_baseline / depth->camera.fx) +
             entry("disparity_sigma", noise.disparity_sigma);
    }
  }
  if (const auto& stereo = calibration.stereo_camera) {
    out += "stereo_camera:\n" + yaml_camera(stereo->camera) + entry("baseline", stereo->baseline) +
           entry("disparity_sigma", stereo->disparity_sigma);
  }
  if (const auto& lidar = calibration.lidar) {
    out += "lidar:\n" + entry("range_sigma", lidar->noise.range_sigma) +
           "  T_body_lidar: " + yaml_pose(lidar->T_body_lidar) + "\n";
  }
  const OdometryModel& odometry = calibration.odometry;
  out += "odometry:\n" + entry("sigma_translation", odometry.sigma_translation) +
         entry("sigma_rotation", odometry.sigma_rotation) +
         "  planar: " + (odometry.planar ? "true\n" : "false\n");
  return out;
}

DatasetCounts write_dataset(World world, const fs::path& folder, const DatasetOptions& options) {
  Simulation simulation(std::move(world), options.seed);
  Writer writer(folder, options.labels);
  writer.record_as(options.format, simulation.calibration());
  const std::string head =
      "# scene " + simulation.world().name + ", seed " + std::to_string(options.seed) + "\n";
  writer.line("calibration.yaml", head, to_yaml(simulation.calibration()));
  Calibration truth = simulation.calibration();
  if (truth.depth_camera) truth.depth_camera = simulation.world().rig.depth->camera;
  if (truth.stereo_camera) truth.stereo_camera = simulation.world().rig.stereo->camera;
  if (truth.lidar) truth.lidar = simulation.world().rig.lidar->model;
  writer.line("calibration_true.yaml", head + "# where the sensors really sit\n", to_yaml(truth));
  const std::int64_t all = *simulation.size_hint();
  std::int64_t done = 0;
  const double end = simulation.world().start_time + options.max_duration + 1e-9;
  while (auto measurement = simulation.next()) {
    if (options.max_duration > 0 && stamp_of(*measurement).seconds() > end) {
      break;
    }
    std::visit([&](const auto& value) { writer.write(value, simulation); }, *measurement);
    if (options.progress && !options.progress(++done, all)) {
      break;
    }
  }
  for (const StampedPose& pose : simulation.truth()) {
    writer.line("groundtruth.txt", "# timestamp tx ty tz qx qy qz qw\n",
                pose_line(pose.stamp, pose.pose));
  }
  writer.close();
  Truth known = truth_of(simulation, options.seed);
  if (options.grid) {
    GridRules rules;
    rules.resolution = options.grid_resolution;
    rules.robot_height = simulation.world().robot_height;
    known.grid = grid_truth(simulation.world(), simulation.caster(), rules);
  }
  write_truth(known, folder);
  return writer.counts();
}

}  // namespace lamina::sim
