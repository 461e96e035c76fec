// What the segment front-end makes of a recording, in figures and a picture.
//   segments_report [--list] INPUT [PICTURE.svg [TRAJECTORY.txt]]
// INPUT: a recording, or sim:NAME[,SEED[,key=value...]] with the scene's settings. --list: every
// switch of id and false match of a simulated one.
// The picture is drawn along TRAJECTORY (of a map), or along odometry.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>

#include <lamina/frontend/segments/segment_frontend.hpp>
#include <lamina/models/error.hpp>
#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sim/sim_recording.hpp>

#include "bench/segments_truth.hpp"

using namespace lamina;

namespace {

struct Item {
  LaserScan scan;
  std::vector<int> planes;  // simulated: the true plane behind each beam
};

struct Input {
  std::vector<Item> items;
  OdometryTrack odometry;
  OdometryModel model;
  std::vector<Plane> planes_map;  // simulated
};

Input read_input(const std::string& name) {
  Input input;
  std::unique_ptr<Recording> recording;
  const sim::Simulation* simulation = nullptr;
  if (name.rfind("sim:", 0) == 0) {
    std::vector<std::string> words;
    std::istringstream stream(name.substr(4));
    for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
    const std::uint64_t seed = words.size() > 1 ? std::stoull(words[1]) : 1;
    sim::Parameters parameters;
    for (std::size_t k = 2; k < words.size(); ++k) {
      const std::size_t equals = words[k].find('=');
      if (equals == std::string::npos) throw Error(words[k] + ": expected KEY=VALUE");
      parameters[words[k].substr(0, equals)] = words[k].substr(equals + 1);
    }
    sim::World world = sim::make_scene(words.at(0), parameters);
    world.rig.depth.reset();
    world.rig.stereo.reset();
    auto owned = std::make_unique<sim::Simulation>(std::move(world), seed);
    simulation = owned.get();
    recording = std::move(owned);
    for (const sim::ScenePlane& plane : simulation->world().scene.planes()) {
      input.planes_map.push_back(plane.plane_map);
    }
  } else {
    recording = open_recording(name);
  }
  std::vector<Odometry> samples;
  while (std::optional<Measurement> m = recording->next()) {
    if (const Odometry* odometry = std::get_if<Odometry>(&*m)) samples.push_back(*odometry);
    LaserScan* scan = std::get_if<LaserScan>(&*m);
    if (!scan) continue;
    Item item{std::move(*scan), {}};
    if (simulation) {
      for (const std::int32_t s : simulation->scan_truth().surfaces) {
        item.planes.push_back(s < 0 ? -1 : simulation->caster().plane_of(s));
      }
    }
    input.items.push_back(std::move(item));
  }
  input.odometry = OdometryTrack(samples);
  input.model = recording->calibration().odometry;
  return input;
}

std::string colour(std::int64_t track) {
  if (track < 0) return "#bbbbbb";
  return "hsl(" + std::to_string((track * 137) % 360) + ",75%,42%)";
}

// Top view: segments by track, the path.
class Picture {
 public:
  void add(const Observations& out, const SE3& T_odom_body) {
    path_.push_back(T_odom_body.translation());
    for (const SegmentObservation& s : out.segments) {
      const SE3 T = T_odom_body * out.T_body_sensor;
      lines_.push_back({T * Eigen::Vector3d(s.segment.start.x(), s.segment.start.y(), 0),
                        T * Eigen::Vector3d(s.segment.end.x(), s.segment.end.y(), 0), s.track});
    }
  }
  void write(const std::string& file) const {
    constexpr std::size_t kMostLines = 4000, kMostPoses = 1000;
    Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
    for (const Line& line : lines_) {
      low = low.cwiseMin(line.a.head<2>()).cwiseMin(line.b.head<2>());
      high = high.cwiseMax(line.a.head<2>()).cwiseMax(line.b.head<2>());
    }
    const double scale = 1200 / std::max(1e-3, (high - low).maxCoeff());
    std::ofstream out(file);
    const Eigen::Vector2d size = (high - low) * scale;
    out << "<svg xmlns='http://www.w3.org/2000/svg' width='" << int(size.x()) + 20 << "' height='"
        << int(size.y()) + 20 << "'><rect width='100%' height='100%' fill='white'/>\n";
    char text[256];
    const auto x = [&](const Eigen::Vector3d& p) { return int(10 + (p.x() - low.x()) * scale); };
    const auto y = [&](const Eigen::Vector3d& p) { return int(10 + (high.y() - p.y()) * scale); };
    std::map<std::string, std::string> by_colour;  // small files: one path a colour, whole pixels
    const std::size_t every = 1 + lines_.size() / kMostLines;
    for (std::size_t i = 0; i < lines_.size(); i += every) {
      const Line& line = lines_[i];
      std::snprintf(text, sizeof text, "M%d %dL%d %d", x(line.a), y(line.a), x(line.b), y(line.b));
      by_colour[colour(line.track)] += text;
    }
    for (const auto& [stroke, path] : by_colour) {
      out << "<path d='" << path << "' stroke='" << stroke << "' stroke-opacity='.6'/>\n";
    }
    out << "<polyline fill='none' stroke='black' points='";
    for (std::size_t i = 0; i < path_.size(); i += 1 + path_.size() / kMostPoses) {
      std::snprintf(text, sizeof text, "%d,%d ", x(path_[i]), y(path_[i]));
      out << text;
    }
    out << "'/></svg>\n";
  }

 private:
  struct Line {
    Eigen::Vector3d a, b;
    std::int64_t track;
  };
  std::vector<Line> lines_;
  std::vector<Eigen::Vector3d> path_;
};

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

int run(const std::string& name, const char* picture_file, const char* path_file, bool list) {
  const Trajectory path = path_file ? Trajectory::read_tum(path_file) : Trajectory();
  const Input input = read_input(name);
  TrackingOptions tracking;
  tracking.odometry = input.model;
  SegmentFrontend frontend({}, tracking);
  Picture picture;
  TrackTruth truth(input.planes_map, list);
  std::map<std::int64_t, int> length;
  std::vector<double> times, scales;
  std::int64_t segments = 0, tracked = 0, returns = 0, loose = 0, curved = 0;
  std::optional<SE3> T_odom_last;
  const std::size_t stride = std::max<std::size_t>(1, input.items.size() / 800);
  for (std::size_t k = 0; k < input.items.size(); ++k) {
    const Item& item = input.items[k];
    const std::optional<Odometry> odometry = input.odometry.at(item.scan.stamp);
    std::optional<SE3> motion;
    if (odometry && T_odom_last) motion = T_odom_last->inverse() * odometry->T_odom_body;
    if (odometry) T_odom_last = odometry->T_odom_body;
    const auto start = std::chrono::steady_clock::now();
    const Observations out = frontend.process(item.scan, motion);
    times.push_back(
        1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    scales.push_back(frontend.last().noise_scale);
    segments += static_cast<std::int64_t>(out.segments.size());
    curved += frontend.last().curved;
    loose += static_cast<std::int64_t>(frontend.last().loose_beams.size());
    returns += static_cast<std::int64_t>(item.scan.size()) - frontend.last().missing;
    for (const SegmentObservation& s : out.segments) {
      tracked += s.track >= 0 ? 1 : 0;
      if (s.track >= 0) ++length[s.track];
    }
    if (!item.planes.empty()) truth.add(out, T_odom_last.value_or(SE3()), item.planes);
    const std::optional<SE3> drawn = path.empty() ? T_odom_last : path.at(item.scan.stamp);
    if (k % stride == 0 && drawn) picture.add(out, *drawn);
  }
  std::vector<double> lengths;
  for (const auto& [id, n] : length) lengths.push_back(n);
  const double scans = std::max<double>(1, static_cast<double>(input.items.size()));
  const TrackingCounts& counts = frontend.tracker().counts();
  std::printf("%s: %zu scans\n", name.c_str(), input.items.size());
  for (const auto& [why, n] : frontend.skipped())
    std::printf("  skipped: %s %ld\n", why.c_str(), n);
  std::printf("  segments a scan %.2f (%.1f %% on counted tracks), curved pieces a scan %.2f\n",
              double(segments) / scans,
              100.0 * double(tracked) / std::max<double>(1, double(segments)),
              double(curved) / scans);
  std::printf("  share of returns explained %.3f, roughness over the noise model: median %.2f\n",
              1 - double(loose) / std::max<double>(1, double(returns)), quantile(scales, 0.5));
  std::printf("  tracks %zu, sightings of each: median %.0f, p90 %.0f, longest %.0f\n",
              lengths.size(), quantile(lengths, 0.5), quantile(lengths, 0.9), quantile(lengths, 1));
  std::printf("  births %ld, bends %ld, reacquired %ld, fragments %ld\n", counts.births,
              counts.bends, counts.reacquired, counts.fragments);
  std::printf("  time a scan: median %.3f ms, p95 %.3f ms\n", quantile(times, 0.5),
              quantile(times, 0.95));
  truth.print();
  if (picture_file) picture.write(picture_file);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<const char*> words(argv + 1, argv + argc);
  const auto list = std::find(words.begin(), words.end(), std::string("--list"));
  const bool listed = list != words.end();
  if (listed) words.erase(list);
  if (words.empty()) {
    std::fprintf(stderr,
                 "usage: segments_report [--list] INPUT|sim:NAME[,SEED[,KEY=VALUE...]] "
                 "[PICTURE.svg [TRAJECTORY.txt]]\n");
    return 2;
  }
  words.resize(3, nullptr);
  try {
    return run(words[0], words[1], words[2], listed);
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
