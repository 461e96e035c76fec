// A simulated room whose recording can be spoilt, and what mapping it comes to.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include <lamina/sensors/calibration.hpp>
#include <lamina/sensors/readers/image_file.hpp>
#include <lamina/sim/dataset.hpp>

namespace lamina {

namespace fs = std::filesystem;

// A fresh folder that goes with the test.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "lamina_faults_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// One lap of the furnished room by scans and wheels, by scans alone, or its first quarter by a
// depth camera alone or by all three.
enum class Senses { kScansAndWheels, kScans, kDepth, kAll };
inline void simulate_room(const fs::path& folder, Senses senses = Senses::kScansAndWheels) {
  sim::DatasetOptions options;
  options.grid = false;
  const bool all = senses == Senses::kAll, depth = senses == Senses::kDepth;
  if (depth || all) options.max_duration = 16;
  const char* other = depth ? "lidar.enabled" : "camera.enabled";
  sim::write_dataset(sim::make_scene("room", {{other, all ? "true" : "false"}}), folder, options);
  if (depth || senses == Senses::kScans) fs::remove(folder / "odometry.txt");
}

// Every line of a file through `edit(time, line)`; false drops it. Comments stay.
inline void edit_lines(const fs::path& file,
                       const std::function<bool(double, std::string&)>& edit) {
  std::ifstream in(file);
  std::stringstream out;
  for (std::string line; std::getline(in, line);) {
    char* end = nullptr;
    const double time = std::strtod(line.c_str(), &end);
    const bool data = end != line.c_str();
    if (!data || edit(time, line)) out << line << '\n';
  }
  in.close();
  std::ofstream(file) << out.str();
}

// The line with another number in front.
inline std::string with_time(const std::string& line, double time) {
  std::ostringstream out;
  out.precision(15);
  out << time << line.substr(line.find_first_of(", "));
  return out.str();
}

// Every image of depth.txt through `edit(time, image)`.
inline void edit_images(const fs::path& folder,
                        const std::function<void(double, DepthImage&)>& edit) {
  const DepthCamera camera = *read_calibration(folder / "calibration.yaml").depth_camera;
  edit_lines(folder / "depth.txt", [&](double time, std::string& line) {
    const fs::path file = folder / line.substr(line.find(' ') + 1);
    std::string why;
    auto image = read_depth_image(file, camera.camera.width, camera.camera.height, why);
    EXPECT_TRUE(image) << why;
    edit(time, *image);
    std::ofstream(file, std::ios::binary) << encode_png_depth(*image);
    return true;
  });
}

// Every range of scans.csv through `edit(scan, beam, range)`.
inline void edit_ranges(const fs::path& file, const std::function<double(int, int, double)>& edit) {
  int scan = 0;
  edit_lines(file, [&](double, std::string& line) {
    constexpr int kHead = 5;  // timestamp, angles, limits
    std::stringstream in(line);
    std::string out, cell;
    for (int i = 0; std::getline(in, cell, ','); ++i) {
      if (i >= kHead) cell = std::to_string(edit(scan, i - kHead, std::stod(cell)));
      out += (i > 0 ? "," : "") + cell;
    }
    line = out;
    ++scan;
    return true;
  });
}

struct Outcome {
  double ate = 0;
  int poses = 0;
  std::size_t spurious = 0;
  bool says_lost = false;
  double lost_after = 0;  // s, the last stamp that was tracked
};

/// Through the program, offline, against the truth beside the recording.
Outcome map_and_evaluate(const Folder& folder, const fs::path& data);

constexpr double kStart = 1000;  // s: first stamp of simulated recordings

}  // namespace lamina
