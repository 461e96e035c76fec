// The floor front-end's table: speed, planes, plates, false alarms, heights, mounting, recordings.
//   floor_bench all | time | planes | apart | plates | flat | tilt | heights | mounting
//   floor_bench table1    heights of obstacles' tops: sections x sensors x distances, 20 runs
//   floor_bench real FOLDER [v | straight]    a recording's floor; v: frame by frame;
//                                             straight: less the bend that its planes tell
//   floor_bench least FOLDER [PASSES]    a recording's times, of each frame the least of 8 passes
//   floor_bench picture SCENE|FOLDER INDEX FILE.ppm    labels as colours
#include <lamina/frontend/depth/blocks.hpp>
#include <lamina/models/freed_memory.hpp>
#include <lamina/pipeline/calibration/camera/distortion_estimator.hpp>

#include "bench/floor_bench_scenes.hpp"

namespace {

// ---------------------------------------------------------------------------------- low obstacles
bool covers(const std::vector<LowObstacle>& found, const Eigen::Vector2d& c, double reach) {
  for (const auto& o : found) {
    if ((o.center_body - c).norm() < reach) return true;
  }
  return false;
}

void bench_plates(int seeds) {
  const std::vector<double> distances{1.0, 1.5, 2.0, 2.5, 3.0};
  std::map<double, std::pair<int, int>> thin, thick, ten;
  double height_error = 0;
  int heights = 0, false_patches = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    Stage stage("plates", {}, static_cast<std::uint64_t>(seed) + 1);
    const double roll = std::sin(seed * 1.7) * kDegree, pitch = std::cos(seed * 2.3) * kDegree;
    FloorFrontend frontend;
    FloorMemory memory(frontend.options());
    for (int k = 0; k < 10; ++k) {
      const DepthFrame f = stage.frame(SE3(), static_cast<std::uint64_t>(k), roll, pitch);
      const FloorResult r = frontend.process(f);
      memory.add(r, SE3());
      if (k > 0 && k < 9) continue;
      const auto found = k == 0 ? r.low_obstacles : memory.low_obstacles();
      for (std::size_t i = 0; i < distances.size(); ++i) {
        const double y = 0.16 + 0.06 * static_cast<double>(i);
        const bool hit = covers(found, {distances[i], y}, 0.12);
        if (k == 0) {
          auto& t = thin[distances[i]];
          t.first += hit;
          ++t.second;
          auto& w = thick[distances[i]];
          w.first += covers(found, {distances[i], -y}, 0.12);
          ++w.second;
        } else {
          auto& t = ten[distances[i]];
          t.first += hit;
          ++t.second;
        }
      }
      if (k > 0) continue;
      for (const auto& o : found) {
        bool real = false;
        for (std::size_t i = 0; i < distances.size(); ++i) {
          const double y = 0.16 + 0.06 * static_cast<double>(i);
          for (const double side : {1.0, -1.0}) {
            if ((o.center_body - Eigen::Vector2d(distances[i], side * y)).norm() > 0.2) continue;
            real = true;
            height_error += std::abs(o.height - (side > 0 ? 0.01 : 0.02));
            ++heights;
          }
        }
        false_patches += !real;
      }
    }
  }
  for (double d : distances) {
    std::printf("plate at %.1f m: 1 cm %.1f %%  2 cm %.1f %%  1 cm after ten frames %.1f %%\n", d,
                100.0 * thin[d].first / thin[d].second, 100.0 * thick[d].first / thick[d].second,
                100.0 * ten[d].first / ten[d].second);
  }
  std::printf("plates: mean height error %.2f mm, %d false patches in %d frames\n",
              1000 * height_error / std::max(1, heights), false_patches, seeds);
}

void bench_flat(int frames) {
  std::int64_t cells = 0, seen = 0, patches = 0;
  double worst_height = 0, worst_tilt = 0;
  int not_found = 0;
  for (int i = 0; i < frames; ++i) {
    if (i % 20 != 0) continue;
    Stage stage("flat", {}, static_cast<std::uint64_t>(i) + 1);
    for (int k = 0; k < 20; ++k) {
      const double roll = std::sin((i + k) * 1.7) * kDegree,
                   pitch = std::cos((i + k) * 2.3) * kDegree;
      FloorFrontend frontend;
      const FloorResult r =
          frontend.process(stage.frame(SE3(), static_cast<std::uint64_t>(k), roll, pitch));
      not_found += r.status != FloorStatus::kFound;
      for (const auto& o : r.low_obstacles) {
        ++patches;
        cells += static_cast<std::int64_t>(o.cells.size());
      }
      cells += static_cast<std::int64_t>(r.obstacle_points_body.size());
      for (const auto& c : r.surface.cells()) seen += c.pixels > 0;
      if (!r.floor_camera) continue;
      const Leveling l = leveling_of(stage.T_body_camera(), *r.floor_camera);
      worst_tilt = std::max(worst_tilt, std::hypot(l.roll, l.pitch));
      worst_height =
          std::max(worst_height, std::abs(l.height - stage.T_body_camera().translation().z()));
    }
  }
  std::printf(
      "flat: %lld false cells of %lld seen (%.4f %%), %lld patches, %d frames; floor missed %d; "
      "worst height %.2f mm, tilt %.4f deg\n",
      static_cast<long long>(cells), static_cast<long long>(seen),
      100.0 * static_cast<double>(cells) / static_cast<double>(std::max<std::int64_t>(1, seen)),
      static_cast<long long>(patches), frames, not_found, 1000 * worst_height,
      worst_tilt / kDegree);
}

// ---------------------------------------------------------------------------------- Table 1
void bench_heights(int seeds) {
  for (const char* sensor : {"kinect", "stereo"}) {
    for (const auto& sections :
         {std::array{3, 2}, std::array{4, 3}, std::array{8, 6}, std::array{12, 9}}) {
      double sum[2] = {0, 0};
      int count[2] = {0, 0};
      for (int seed = 0; seed < seeds; ++seed) {
        sim::Parameters parameters{{"camera.model", sensor}};
        if (std::strcmp(sensor, "stereo") == 0) {
          parameters["camera.baseline_m"] = "0.24";
          parameters["camera.fx"] = "491.5";
        }
        Stage stage("obstacle_bed", parameters, static_cast<std::uint64_t>(seed) + 1);
        FloorOptions options;
        options.sections = sections;
        options.roi_m = {6.0, 4.2, 0.75};
        FloorFrontend frontend(options);
        const SE3 pose = pose_on_path(stage.world, seed / static_cast<double>(seeds));
        const FloorResult r = frontend.process(stage.frame(pose, 0));
        if (r.surface.empty()) continue;
        // Highest cell over each box, where the box is well in view.
        for (const auto& plane : stage.world.scene.planes()) {
          if (plane.name.rfind("box.", 0) != 0 || plane.name.find("top") == std::string::npos)
            continue;
          Eigen::Vector3d c = Eigen::Vector3d::Zero();
          for (const auto& x : plane.outline_map)
            c += x / static_cast<double>(plane.outline_map.size());
          const Eigen::Vector3d b = pose.inverse() * c;
          const double range = (b - stage.T_body_camera().translation()).norm();
          double top = -1;
          int cells = 0;
          for (int i = 0; i < r.surface.nx(); ++i) {
            for (int j = 0; j < r.surface.ny(); ++j) {
              if ((r.surface.center(i, j) - b.head<2>()).norm() > 0.08) continue;
              const auto& cell = r.surface.at(i, j);
              if (!(cell.pixels > 0)) continue;
              ++cells;
              top = std::max(top, static_cast<double>(cell.top));
            }
          }
          if (cells < 2 || range > 5.5) continue;
          const int band = range < 3 ? 0 : 1;
          sum[band] += std::abs(top - c.z());
          ++count[band];
        }
      }
      std::printf("%-7s %2d x %d: < 3 m %.2f cm (%d), 3 to 5.5 m %.2f cm (%d)\n", sensor,
                  sections[0], sections[1], 100 * sum[0] / std::max(1, count[0]), count[0],
                  100 * sum[1] / std::max(1, count[1]), count[1]);
    }
  }
}

// ---------------------------------------------------------------------------------- mounting
void bench_mounting() {
  for (const char* scene : {"flat", "room", "steps", "stairs_down"}) {
    double worst_tilt = 0, worst_height = 0, tracked_tilt = 0, tracked_height = 0;
    int found = 0, all = 0;
    for (int a = -5; a <= 5; ++a) {
      Stage stage(scene, {}, static_cast<std::uint64_t>(a + 6));
      FloorFrontend frontend;
      FloorResult r;
      for (int k = 0; k < 6; ++k) {
        const SE3 pose = pose_on_path(stage.world, 0.02 * k);
        r = frontend.process(stage.frame(pose, static_cast<std::uint64_t>(k),
                                         a * kDegree * (a % 2 ? 1 : -1), a * kDegree,
                                         0.01 * (a % 3)));
        ++all;
        if (!r.floor_camera) continue;
        ++found;
        const Leveling l = leveling_of(stage.T_body_camera(), *r.floor_camera);
        worst_tilt = std::max(worst_tilt, std::hypot(l.roll, l.pitch));
        worst_height =
            std::max(worst_height, std::abs(l.height - stage.T_body_camera().translation().z()));
      }
      const SE3 difference = r.mounting.T_body_camera * stage.T_body_camera().inverse();
      tracked_tilt = std::max(tracked_tilt, difference.so3().log().head<2>().norm());
      tracked_height = std::max(
          tracked_height, std::abs(r.mounting.height - stage.T_body_camera().translation().z()));
    }
    std::printf(
        "%-12s floor in %d of %d; single frame worst %.3f deg %.2f mm; tracked %.3f deg %.2f mm\n",
        scene, found, all, worst_tilt / kDegree, 1000 * worst_height, tracked_tilt / kDegree,
        1000 * tracked_height);
  }
}

// ---------------------------------------------------------------------------------- recordings
// Heights from disjoint halves of the floor's pixels: how much of their variation they share. What
// both halves of a checkerboard do not share is noise; what left and right do not is distortion.
struct Halves {
  std::vector<double> a, b;

  void add(const DisparityGeometry& g, const DisparitySums& first, const DisparitySums& second) {
    const auto p = first.fit(), q = second.fit();
    if (!p || !q || !g.plane(*p) || !g.plane(*q)) return;
    a.push_back(-g.plane(*p)->rho());
    b.push_back(-g.plane(*q)->rho());
  }
  void print(const char* name) const {
    double ma = 0, mb = 0, difference = 0, shared = 0;
    const double n = static_cast<double>(std::max<std::size_t>(1, a.size()));
    for (std::size_t i = 0; i < a.size(); ++i) ma += a[i] / n, mb += b[i] / n;
    for (std::size_t i = 0; i < a.size(); ++i) {
      difference += std::pow((a[i] - ma) - (b[i] - mb), 2) / n;
      shared += (a[i] - ma) * (b[i] - mb) / n;
    }
    std::printf(
        "  %s: heights %.3f and %.3f m, sd of their difference %.1f mm, shared sd %.1f mm\n", name,
        ma, mb, 1000 * std::sqrt(difference), 1000 * std::sqrt(std::max(0.0, shared)));
  }
};

void add_halves(const FloorFrontend& frontend, const DepthFrame& f, const FloorResult& r,
                Halves& checkerboard, Halves& sides) {
  const DisparityImage& image = frontend.disparities();
  const DisparityGeometry g = DisparityGeometry::of(f.camera);
  DisparitySums board[2], side[2];
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const double d = static_cast<double>(image.row(v)[u]);
      if (!(d > 0) || r.plane_at(u, v, image.width) != r.dominant) continue;
      board[(u / 16 + v / 16) % 2].add(u - g.cx, v - g.cy, d);
      side[u > g.cx].add(u - g.cx, v - g.cy, d);
    }
  }
  checkerboard.add(g, board[0], board[1]);
  sides.add(g, side[0], side[1]);
}

// What some 120 images tell of their bend, as `lamina map` takes it out.
DepthDistortion bend_of(const char* folder) {
  const auto recording = open_recording(folder);
  const std::int64_t every =
      std::max<std::int64_t>(1, recording->depth_hint().value_or(1200) / 120);
  FloorFrontend frontend;
  DistortionEstimator estimator;
  for (auto frame = recording->next_depth(0); frame; frame = recording->next_depth(every - 1)) {
    const FloorResult floor = frontend.process(*frame);
    estimator.add(floor, frontend.disparities(), frame->camera.camera);
  }
  return estimator.estimate().value_or(DepthDistortion());
}

void bench_real(const char* folder, bool verbose, bool straight) {
  const DepthDistortion bend = straight ? bend_of(folder) : DepthDistortion();
  const auto recording = open_recording(folder);
  FloorFrontend frontend;
  std::vector<double> heights, tilts;
  std::vector<FloorStageTimes> times;
  std::map<std::string, int> status;
  int low = 0, planes = 0, frames = 0;
  double share = 0;
  Halves checkerboard, sides;
  while (auto m = recording->next()) {
    DepthFrame* f = std::get_if<DepthFrame>(&*m);
    if (!f) continue;
    bend.correct(*f);
    const FloorResult r = frontend.process(*f);
    ++frames;
    ++status[to_string(r.status)];
    times.push_back(r.times);
    low += static_cast<int>(r.low_obstacles.size());
    planes += static_cast<int>(r.planes.size());
    if (r.floor_camera) {
      add_halves(frontend, *f, r, checkerboard, sides);
      const Leveling l = leveling_of(f->camera.camera.T_body_camera, *r.floor_camera);
      heights.push_back(l.height);
      tilts.push_back(std::hypot(l.roll, l.pitch) / kDegree);
      share += static_cast<double>(r.planes[static_cast<std::size_t>(r.dominant)].pixels) /
               (f->width() * f->height());
    }
    if (verbose) {
      std::printf("%4d %-9s planes %2zu low %2zu", frames - 1, to_string(r.status), r.planes.size(),
                  r.low_obstacles.size());
      if (r.floor_camera)
        std::printf(" height %.3f tilt %.2f tracked %.3f rigid %d", heights.back(), tilts.back(),
                    r.mounting.height, r.mounting.rigid);
      std::printf(" %s\n", r.reason.c_str());
    }
  }
  double mean = 0, var = 0;
  for (double h : heights) mean += h / static_cast<double>(heights.size());
  for (double h : heights) var += (h - mean) * (h - mean) / static_cast<double>(heights.size());
  std::printf("%s: %d frames,", folder, frames);
  for (const auto& [s, n] : status) std::printf(" %s %d,", s.c_str(), n);
  std::printf(
      " height %.3f m sd %.1f mm, tilt %.1f..%.1f deg, floor share %.2f, planes a frame %.1f, low "
      "patches a frame %.2f\n",
      mean, 1000 * std::sqrt(var), quantile(tilts, 0), quantile(tilts, 1),
      share / std::max<std::size_t>(1, heights.size()), 1.0 * planes / frames, 1.0 * low / frames);
  checkerboard.print("halves of a checkerboard");
  sides.print("left and right half");
  print_times("  times", times);
}

void write_picture(const DepthFrame& f, const FloorResult& r, const char* file) {
  std::ofstream out(file, std::ios::binary);
  out << "P6\n" << f.width() << ' ' << f.height() << "\n255\n";
  for (int v = 0; v < f.height(); ++v) {
    for (int u = 0; u < f.width(); ++u) {
      const int k = r.plane_at(u, v, f.width());
      const int grey = std::min(255, static_cast<int>(f.depth_m(u, v) * 40));
      unsigned char c[3] = {static_cast<unsigned char>(grey), static_cast<unsigned char>(grey),
                            static_cast<unsigned char>(grey)};
      if (k >= 0) {
        c[0] = static_cast<unsigned char>(60 + (k * 97 + 40) % 190);
        c[1] = static_cast<unsigned char>(60 + (k * 53 + 110) % 190);
        c[2] = static_cast<unsigned char>(60 + (k * 151 + 70) % 190);
      }
      out.write(reinterpret_cast<const char*>(c), 3);
    }
  }
  for (const auto& p : r.planes) {
    std::printf("  %7lld px kind %d slope %.1f height %.3f area %.2f rms %.3f corners %zu\n",
                static_cast<long long>(p.pixels), static_cast<int>(p.kind), p.slope / kDegree,
                p.height, p.area, p.rms_px, p.outline_camera.size());
  }
  for (const auto& o : r.low_obstacles) {
    std::printf("  low at (%.2f, %.2f) %.1f mm +- %.1f, %zu cells\n", o.center_body.x(),
                o.center_body.y(), 1000 * o.height, 1000 * o.sigma, o.cells.size());
  }
}

void picture(const char* input, int index, const char* file) {
  FloorFrontend frontend;
  if (std::strchr(input, '/') == nullptr) {
    Stage stage(input, {}, static_cast<std::uint64_t>(index) + 1);
    const DepthFrame f =
        stage.frame(pose_on_path(stage.world, index / 20.0), static_cast<std::uint64_t>(index));
    const FloorResult r = frontend.process(f);
    write_picture(f, r, file);
    score_planes(stage, f, r, 1000, true);
    return;
  }
  const auto recording = open_recording(input);
  int i = 0;
  while (const auto m = recording->next()) {
    const DepthFrame* f = std::get_if<DepthFrame>(&*m);
    if (!f) continue;
    const FloorResult r = frontend.process(*f);
    if (i++ == index) return write_picture(*f, r, file);
  }
}

}  // namespace

int main(int argc, char** argv) {
  lamina::keep_freed_memory();  // as the program does
  const std::string verb = argc > 1 ? argv[1] : "all";
  const bool all = verb == "all";
  const int count =
      argc > 2 && verb != "real" && verb != "picture" && verb != "least" ? std::atoi(argv[2]) : 0;
  const std::string how = argc > 3 ? argv[3] : "";
  if (verb == "real" && argc > 2) bench_real(argv[2], how == "v", how == "straight");
  if (verb == "least" && argc > 2)
    bench_least(argv[2], argc > 3 ? std::max(1, std::atoi(argv[3])) : 8);
  if (verb == "picture" && argc > 4) picture(argv[2], std::atoi(argv[3]), argv[4]);
  if (all || verb == "time") bench_time();
  if (all || verb == "planes") bench_planes(argc > 2);
  if (all || verb == "apart") bench_apart();
  if (all || verb == "plates") bench_plates(count > 0 ? count : 50);
  if (all || verb == "flat") bench_flat(count > 0 ? count : 1000);
  if (all || verb == "tilt") bench_tilt(count > 0 ? count : 1000);
  if (all || verb == "heights" || verb == "table1") bench_heights(count > 0 ? count : 20);
  if (all || verb == "mounting") bench_mounting();
  return 0;
}
