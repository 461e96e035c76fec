// The table of the obstacle scans: rims of holes, flat floors, stairs, speed, real potholes.
//   obstacles_bench all | holes | flat [FRAMES] | stairs | time | real FOLDER | methods | trace |
//   bound
// `trace` prints every beam that misses the near edge of a hole, or passes the top of a stair.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sensors/stereo_frame.hpp>
#include <lamina/sim/world.hpp>

#include "bench/obstacles_truth.hpp"

using namespace lamina;

namespace {

struct Rig {
  const char* name;
  sim::Parameters parameters;
};
const Rig kRigs[] = {
    {"0.3 m, grazing on", {}},
    {"0.3 m, grazing off", {{"effects.grazing", "false"}}},
    {"0.8 m, 20 deg down", {{"camera.height_m", "0.8"}, {"camera.pitch_deg", "20"}}}};

// Drives towards the hole with a mounting that is off (deg).
void drive(const char* scene, const Rig& rig, double off, const ScanOptions& options, int frames,
           Rims (&rims)[2], Known (*known)[2] = nullptr) {
  SceneCamera stage(scene, rig.parameters, 7);
  FloorFrontend frontend;
  ObstacleScanner scanner(options);
  for (int k = 0; k < frames; ++k) {
    const double x = -0.9 + 2.0 * k / frames;
    const SE3 T = pose(x, 0.2 * std::sin(k * 1.3), 0.1 * std::sin(k * 2.1));
    const DepthFrame f =
        stage.frame(T, static_cast<std::uint64_t>(k), 0.5 * off * kDegree, off * kDegree);
    const FloorResult floor = frontend.process(f);
    if (trace) std::printf("  frame %d at x %.2f: %s\n", k, x, to_string(floor.status));
    const ObstacleScan scan = scanner.process(f, floor);
    score(stage, T, scan, rims);
    if (known != nullptr) know(stage, T, f, scan, *known);
  }
}

void bench_holes(const ScanOptions& options, int frames) {
  for (const char* scene : {"hole", "hole_no_wall"}) {
    for (const Rig& rig : kRigs) {
      for (const double off : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
        if (trace && off != 0) continue;
        Rims rims[2];
        drive(scene, rig, off, options, frames, rims);
        print((std::string(scene) + " " + rig.name).c_str(), off, rims);
      }
    }
  }
}

// Ours and the document's methods side by side: share of the beams over the near edge that report
// it within 30 cm, to 2 m / to 3 m.
void bench_methods(int frames) {
  ScanOptions document, calibrated;
  document.method = calibrated.method = NegativeMethod::kDocument;
  calibrated.leveled = false;
  std::printf("%-33s %8s  %17s  %17s  %17s\n", "reported to 2 m / to 3 m (%)", "mounting", "ours",
              "document, leveled", "as calibrated");
  for (const char* scene : {"hole", "hole_no_wall"}) {
    for (const Rig& rig : kRigs) {
      for (const double off : {0.0, 1.0}) {
        std::printf("%-13s%-20s %+4.1f deg", scene, rig.name, off);
        for (const ScanOptions& options : {ScanOptions(), document, calibrated}) {
          Rims rims[2];
          drive(scene, rig, off, options, frames, rims);
          std::printf("  %8.1f %8.1f", 100.0 * rims[0].reported / std::max(1, rims[0].beams),
                      100.0 * rims[1].reported / std::max(1, rims[1].beams));
        }
        std::printf("\n");
      }
    }
  }
}

void bench_bound(int frames) {
  for (const Rig& rig : kRigs) {
    Rims rims[2];
    Known known[2];
    drive("hole", rig, 0, {}, frames, rims, &known);
    for (int b = 0; b < 2; ++b) {
      const Known& k = known[b];
      const double n = std::max(1, k.beams);
      std::printf(
          "bound hole %-20s %s: of the last 30 cm before the edge %4.1f %% of the samples return; "
          "%5.1f %% of %d beams have any return there, %5.1f %% have %d; reported %5.1f %%\n",
          rig.name, b == 0 ? "to 2 m" : "to 3 m", 100 * k.returns / std::max(1.0, k.samples),
          100 * k.any / n, k.beams, 100 * k.run / n, ScanOptions().min_run_px,
          100 * rims[b].reported / n);
    }
  }
}

void bench_flat(int frames) {
  int beams[5] = {}, not_found = 0;
  for (int k = 0; k < frames; ++k) {
    const bool low = k % 2 == 0;
    static const sim::Parameters kLow{{"camera.height_m", "0.3"}, {"camera.pitch_deg", "0"}};
    static SceneCamera low_stage("flat", kLow, 3), high_stage("flat", {}, 4);
    SceneCamera& stage = low ? low_stage : high_stage;
    const double off = std::sin(k * 1.7) * kDegree;
    const DepthFrame f = stage.frame(SE3(), static_cast<std::uint64_t>(k), 0.5 * off, off);
    FloorFrontend frontend;
    ObstacleScanner scanner;
    const FloorResult floor = frontend.process(f);
    not_found += floor.status != FloorStatus::kFound;
    for (const BeamCause c : scanner.process(f, floor).cause) ++beams[static_cast<int>(c)];
  }
  std::printf(
      "flat, %d frames, 0.3 m and default mounting, up to 1 deg off: false beams: hole %d, "
      "ledge %d, obstacle %d; edge of knowledge %d, none %d; floor missed %d\n",
      frames, beams[2], beams[3], beams[1], beams[4], beams[0], not_found);
}

void bench_stairs(int frames) {
  SceneCamera stage("stairs_down", {}, 5);
  for (const double off : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    if (trace && off != 0) continue;
    int beams = 0, passed = 0, corner = 0, unknown = 0, negative = 0, obstacles = 0, posts = 0,
        seen = 0, behind = 0;
    FloorFrontend frontend;
    ObstacleScanner scanner;
    for (int k = 0; k < frames; ++k) {
      const SE3 T =
          pose(-0.2 + 2.0 * k / frames, 0.1 * std::sin(k * 1.3), 0.05 * std::sin(k * 2.1));
      const DepthFrame f =
          stage.frame(T, static_cast<std::uint64_t>(k), 0.5 * off * kDegree, off * kDegree);
      const ObstacleScan scan = scanner.process(f, frontend.process(f));
      for (std::size_t i = 0; i < scan.size(); ++i) {
        bool near = false;
        const double truth = crossing(stage.world.scene, T, scan.angle(i), near);
        if (truth < 0 || !near) continue;
        ++beams;
        const bool none = scan.cause[i] == BeamCause::kNone;
        unknown += none || scan.cause[i] == BeamCause::kEdgeOfKnowledge;
        negative += is_negative(scan.cause[i]);
        obstacles += scan.cause[i] == BeamCause::kObstacle;
        const bool past = !none && static_cast<double>(scan.range[i]) > truth + 0.05;
        passed += past;
        bool far = false;
        const double chord = crossing(stage.world.scene, T, scan.angle(i), far, truth) - truth;
        corner += past && chord > 0 && chord < 2 * footprint(stage, truth);
        if (trace && past)
          std::printf(
              "    passed: frame %d beam %zu of %zu, %.2f m: %s %.2f m, floor to %.2f m; over %.2f "
              "m "
              "of the opening, %d returns of its %.1f samples\n",
              k, i, scan.size(), truth, to_string(scan.cause[i]),
              static_cast<double>(scan.range[i]), static_cast<double>(scan.floor_range[i]), chord,
              returns_over(stage, f, scan.angle(i), truth, chord), chord / footprint(stage, truth));
      }
      for (const sim::Cylinder& c : stage.world.scene.cylinders()) {
        if (c.name != "post") continue;
        const Eigen::Vector3d p = T.inverse() * c.base_map;
        const double r = p.head<2>().norm(), a = std::atan2(p.y(), p.x());
        if (r > 3 || r < 0.8 || std::abs(a) > 0.45 || c.base_map.x() > 2.46) continue;
        ++posts;
        bool hit = false, known = false;
        for (int d = -4; d <= 4; ++d) {
          const int b = scan.beam_of(a + d * scan.angle_increment);
          if (b < 0) continue;
          const std::size_t at = static_cast<std::size_t>(b);
          known |=
              scan.cause[at] != BeamCause::kNone && static_cast<double>(scan.range[at]) > r - 0.1;
          hit |= b >= 0 && scan.cause[static_cast<std::size_t>(b)] == BeamCause::kObstacle &&
                 std::abs(static_cast<double>(scan.range[static_cast<std::size_t>(b)]) - r) < 0.1;
        }
        seen += hit;
        behind += !hit && !known;
      }
    }
    std::printf(
        "stairs_down %+.1f deg: %d beams over the first edge, passed %d (%d of them over less than "
        "two samples of the opening, at its corner), no return %.2f %% "
        "(negative %d, obstacle %d); posts of the front railing seen %d of %d, %d of those missed "
        "behind the end of knowledge\n",
        off, beams, passed, corner, 100.0 * unknown / std::max(1, beams), negative, obstacles, seen,
        posts, behind);
  }
}

void bench_time() {
  for (const char* scene : {"hole", "flat", "room", "stairs_down"}) {
    SceneCamera stage(scene, {}, 1);
    const DepthFrame f = stage.frame(stage.world.path.at(0), 0, 0, 0);
    FloorFrontend frontend;
    const FloorResult floor = frontend.process(f);
    ObstacleScanner scanner;
    std::vector<double> ms;
    for (int k = 0; k < 100; ++k) {
      const std::clock_t start = std::clock();
      scanner.process(f, floor, frontend.disparities());
      ms.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    std::printf("time %-12s median %.2f ms of CPU, least %.2f ms\n", scene, quantile(ms, 0.5),
                quantile(ms, 0));
  }
}

void bench_real(const char* folder, bool verbose) {
  const auto recording = open_recording(folder);
  FloorFrontend frontend;
  ObstacleScanner scanner;
  int index = 0, all[5] = {};
  while (const auto m = recording->next()) {
    const StereoFrame* pair = std::get_if<StereoFrame>(&*m);
    const DepthFrame* depth = std::get_if<DepthFrame>(&*m);
    if (!pair && !depth) continue;
    const DepthFrame f = pair ? depth_from_stereo(*pair) : *depth;
    const FloorResult floor = frontend.process(f);
    const ObstacleScan scan = scanner.process(f, floor);
    int beams[5] = {};
    for (const BeamCause c : scan.cause) ++beams[static_cast<int>(c)];
    for (int c = 0; c < 5; ++c) all[c] += beams[c];
    const Eigen::Vector3d ahead = floor.T_body_camera.so3() * Eigen::Vector3d(0, 0, 1);
    std::printf(
        "%3d floor %-9s height %.3f m, looks %.0f deg down: obstacle %d hole %d ledge %d knowledge "
        "%d none %d\n",
        index++, to_string(floor.status), floor.T_body_camera.translation().z(),
        std::asin(-ahead.z()) / kDegree, beams[1], beams[2], beams[3], beams[4], beams[0]);
    if (!floor.reason.empty()) std::printf("      %s\n", floor.reason.c_str());
    // Runs of beams that end alike.
    for (std::size_t i = 0, k = 0; verbose && i < scan.size(); i = k) {
      for (k = i; k < scan.size() && scan.cause[k] == scan.cause[i]; ++k) {
      }
      if (!is_negative(scan.cause[i])) continue;
      std::printf(
          "      %s %.1f to %.1f deg, %.2f to %.2f m\n", to_string(scan.cause[i]),
          scan.angle(i) / kDegree, scan.angle(k - 1) / kDegree,
          static_cast<double>(*std::min_element(scan.range.begin() + static_cast<long>(i),
                                                scan.range.begin() + static_cast<long>(k))),
          static_cast<double>(*std::max_element(scan.range.begin() + static_cast<long>(i),
                                                scan.range.begin() + static_cast<long>(k))));
    }
  }
  std::printf("all %d frames: obstacle %d hole %d ledge %d knowledge %d none %d\n", index, all[1],
              all[2], all[3], all[4], all[0]);
}

void dump(const char* scene, double x, bool grazing) {
  SceneCamera stage(scene, {{"effects.grazing", grazing ? "true" : "false"}}, 7);
  const DepthFrame f = stage.frame(pose(x, 0, 0), 1, 0, 0);
  FloorFrontend frontend;
  ObstacleScanner scanner;
  const FloorResult floor = frontend.process(f);
  std::printf("%s dominant %d height %.4f\n", to_string(floor.status), floor.dominant,
              floor.T_body_camera.translation().z());
  for (const auto& p : floor.planes)
    std::printf("  plane px %ld kind %d area %.2f slope %.1f height %.3f rho %.3f\n",
                static_cast<long>(p.pixels), static_cast<int>(p.kind), p.area, p.slope / kDegree,
                p.height, p.plane_camera.rho());
  const ObstacleScan s = scanner.process(f, floor);
  for (std::size_t i = 0; i < s.size(); i += 25) {
    bool near = false;
    std::printf("  %6.1f deg %s %.2f truth %.2f floor to %.2f\n", s.angle(i) / kDegree,
                to_string(s.cause[i]), static_cast<double>(s.range[i]),
                crossing(stage.world.scene, pose(x, 0, 0), s.angle(i), near),
                static_cast<double>(s.floor_range[i]));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string verb = argc > 1 ? argv[1] : "all";
  const bool all = verb == "all";
  const int count = argc > 2 && verb != "real" ? std::atoi(argv[2]) : 0;
  if (all || verb == "holes") bench_holes({}, count > 0 ? count : 40);
  if (verb == "trace") {
    trace = true;
    bench_holes({}, count > 0 ? count : 12);
    bench_stairs(count > 0 ? count : 12);
  }
  if (all || verb == "flat") bench_flat(count > 0 ? count : 1000);
  if (all || verb == "bound") bench_bound(count > 0 ? count : 12);
  if (all || verb == "stairs") bench_stairs(count > 0 ? count : 40);
  if (all || verb == "time") bench_time();
  if (verb == "real" && argc > 2) bench_real(argv[2], argc > 3);
  if (verb == "dump") dump(argv[2], std::atof(argv[3]), argc > 4);
  if (all || verb == "methods") bench_methods(count > 0 ? count : 10);
  return 0;
}
