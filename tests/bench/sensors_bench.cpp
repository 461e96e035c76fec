// Frames per second of every source: sensors_bench [INPUT...]; without inputs the recordings of
// ../shared/data and mrpt-common. CPU time (the best of several readings), because machines are
// shared; for OpenNI2 files the player's thread is counted, too.
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>

#include <lamina/models/error.hpp>
#include <lamina/sensors/recording.hpp>

namespace {
constexpr int kReadings = 3;

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Reading {
  std::int64_t frames = 0, pairs = 0;
  double read_s = 0, match_s = 0;
};

// Frames are what is neither odometry nor acceleration. Stereo matching is timed apart.
Reading read_once(const std::string& input) {
  Reading result;
  double mark = cpu_seconds();
  const auto recording = lamina::open_recording(input);
  while (const auto m = recording->next()) {
    const bool frame = !std::holds_alternative<lamina::Odometry>(*m) &&
                       !std::holds_alternative<lamina::Accelerometer>(*m);
    result.frames += frame ? 1 : 0;
    if (const auto* pair = std::get_if<lamina::StereoFrame>(&*m)) {
      const double before = cpu_seconds();
      result.pairs += lamina::depth_from_stereo(*pair).raw.empty() ? 0 : 1;
      const double after = cpu_seconds();
      result.match_s += after - before;
      mark += after - before;
    }
  }
  result.read_s = cpu_seconds() - mark;
  return result;
}

// By the last two parts of its path: where recordings lie is one machine's affair.
std::string name_of(const std::filesystem::path& input) {
  return (input.parent_path().filename() / input.filename()).string();
}

void report(const std::string& input) {
  Reading best;
  for (int i = 0; i < kReadings; ++i) {
    const Reading reading = read_once(input);
    if (i == 0 || reading.read_s < best.read_s) best = reading;
  }
  const std::string all = name_of(input);
  const std::string name = all.size() > 44 ? "..." + all.substr(all.size() - 41) : all;
  std::printf("%-44s %6lld frames  %8.3f ms a frame  %9.0f frames/s\n", name.c_str(),
              static_cast<long long>(best.frames),
              1e3 * best.read_s / static_cast<double>(best.frames),
              static_cast<double>(best.frames) / best.read_s);
  if (best.pairs == 0) return;
  std::printf("%-44s %6lld pairs   %8.3f ms a pair\n", "  matched to depth",
              static_cast<long long>(best.pairs),
              1e3 * best.match_s / static_cast<double>(best.pairs));
}
}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> inputs(argv + 1, argv + argc);
  if (inputs.empty()) {
    const char* given = std::getenv("LAMINA_DATA");
    const std::string data = given ? given : LAMINA_SOURCE_DIR "/../shared/data";
    const std::string mrpt = "/usr/share/mrpt/datasets/";
    for (const char* name :
         {"icsl_corridor", "tum_fr3_structure_notexture_far", "stereo_potholes_1",
          "freiburg_079/freiburg-079.log", "mines_exp1/exp1.log", "openni_kinect/recording.oni"}) {
      inputs.push_back(data + "/" + name);
    }
    inputs.push_back(mrpt + "2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog");
    inputs.push_back(mrpt + "tests_rgbd.rawlog");
  }
  int failed = 0;
  for (const std::string& input : inputs) {
    try {
      report(input);
    } catch (const lamina::Error& error) {
      std::printf("%s\n", error.what());
      failed = 2;
    }
  }
  return failed;
}
