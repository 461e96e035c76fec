// What is true of holes in a scene, and scores of scans against it; part of obstacles_bench.cpp
// alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <lamina/frontend/obstacles/obstacle_scanner.hpp>

#include "bench/scene_camera.hpp"

using namespace lamina;

namespace {

SE3 pose(double x, double y, double yaw) { return SE3(SO3::rot_z(yaw), {x, y, 0}); }

// Range at which a beam first crosses a rim beyond `from`, -1: never. `near`: that rim faces the
// robot.
double crossing(const sim::Scene& scene, const SE3& T_map_body, double angle, bool& near,
                double from = 0) {
  const Eigen::Vector2d o = T_map_body.translation().head<2>();
  const Eigen::Vector3d d3 =
      T_map_body.so3() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
  const Eigen::Vector2d d = d3.head<2>();
  double best = -1;
  for (const sim::HoleEdge& e : scene.hole_edges()) {
    const Eigen::Vector2d a = e.from_map.head<2>(), s = e.to_map.head<2>() - a;
    const double cross = d.x() * s.y() - d.y() * s.x();
    if (std::abs(cross) < 1e-9) continue;
    const Eigen::Vector2d w = a - o;
    const double r = (w.x() * s.y() - w.y() * s.x()) / cross;
    const double k = (w.x() * d.y() - w.y() * d.x()) / cross;
    if (r > from && k >= 0 && k <= 1 && (best < 0 || r < best)) {
      best = r;
      near = std::abs(s.x()) < 1e-6;
    }
  }
  return best;
}

double quantile(std::vector<double> v, double q) {
  if (v.empty()) return NAN;
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, static_cast<std::size_t>(q * static_cast<double>(v.size())))];
}

struct Rims {
  int beams = 0, reported = 0, passed = 0;
  std::vector<double> errors;
};

// Beams over the near edge, by range of the edge: up to 2 m, 2 to 3 m.
// Does the camera have that point of the floor in view?
bool in_view(const SceneCamera& stage, double angle, double range) {
  const CameraModel& c = stage.world.rig.depth->camera.camera;
  const Eigen::Vector3d p = c.T_body_camera.inverse() *
                            Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0);
  if (!(p.z() > 0)) return false;
  const double u = c.fx * p.x() / p.z() + c.cx, v = c.fy * p.y() / p.z() + c.cy;
  return u >= 0 && u <= c.width - 1 && v >= 0 && v <= c.height - 1;
}

bool trace = false;  // print each missed beam

void score(const SceneCamera& stage, const SE3& T, const ObstacleScan& scan, Rims (&rims)[2]) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    bool near = false;
    const double truth = crossing(stage.world.scene, T, scan.angle(i), near);
    if (truth < 0 || !near || truth > 3 || !in_view(stage, scan.angle(i), truth)) continue;
    Rims& r = rims[truth <= 2 ? 0 : 1];
    ++r.beams;
    if (trace &&
        !(scan.cause[i] != BeamCause::kNone && scan.cause[i] != BeamCause::kEdgeOfKnowledge &&
          std::abs(static_cast<double>(scan.range[i]) - truth) <= 0.3)) {
      const Eigen::Vector3d c =
          T * Eigen::Vector3d(truth * std::cos(scan.angle(i)), truth * std::sin(scan.angle(i)), 0);
      std::printf("    missed: beam %zu of %zu, %.2f m at y %.2f: %s %.2f m, floor to %.2f m\n", i,
                  scan.size(), truth, c.y(), to_string(scan.cause[i]),
                  static_cast<double>(scan.range[i]), static_cast<double>(scan.floor_range[i]));
    }
    if (scan.cause[i] == BeamCause::kNone || scan.cause[i] == BeamCause::kEdgeOfKnowledge) continue;
    const double error = static_cast<double>(scan.range[i]) - truth;
    r.passed += error > 0.3;
    if (std::abs(error) > 0.3) continue;
    ++r.reported;
    r.errors.push_back(error);
  }
}

void print(const char* name, double off, const Rims (&rims)[2]) {
  std::printf("%-30s %+.1f deg", name, off);
  const double limit[2] = {0.03, 0.06};
  for (int b = 0; b < 2; ++b) {
    const Rims& r = rims[b];
    double mean = 0;
    int within = 0;
    for (double e : r.errors) {
      mean += e / static_cast<double>(r.errors.size());
      within += std::abs(e) <= limit[b];
    }
    std::printf("  | %s %6.2f %% of %6d, passed %.2f %%, bias %+.1f cm, within %.0f cm %5.1f %%",
                b == 0 ? "to 2 m" : "to 3 m", 100.0 * r.reported / std::max(1, r.beams), r.beams,
                100.0 * r.passed / std::max(1, r.beams), 100 * mean, 100 * limit[b],
                100.0 * within / std::max<std::size_t>(1, r.errors.size()));
  }
  std::printf("\n");
}

// Pixels that look at the floor of a beam between two ranges and have a return.
int returns_over(const SceneCamera& stage, const DepthFrame& f, double angle, double from,
                 double length, int* samples = nullptr) {
  const CameraModel& c = stage.world.rig.depth->camera.camera;
  int count = 0, row = -1;
  for (double r = from; r < from + length; r += 1e-3) {
    const Eigen::Vector3d p =
        c.T_body_camera.inverse() * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), 0);
    const int u = static_cast<int>(c.fx * p.x() / p.z() + c.cx + 0.5);
    const int v = static_cast<int>(c.fy * p.y() / p.z() + c.cy + 0.5);
    if (!(p.z() > 0) || u < 0 || v < 0 || u >= c.width || v >= c.height || v == row) continue;
    row = v;
    count += f.raw_at(u, v) != 0;
    if (samples != nullptr) ++*samples;
  }
  return count;
}

// What the data holds of near edges, whatever is made of it: returns of floor in the last 30 cm.
struct Known {
  int beams = 0, any = 0, run = 0;
  double samples = 0, returns = 0;
};

void know(SceneCamera& stage, const SE3& T, const DepthFrame& f, const ObstacleScan& scan,
          Known (&known)[2]) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    bool near = false;
    const double truth = crossing(stage.world.scene, T, scan.angle(i), near);
    if (truth < 0 || !near || truth > 3 || !in_view(stage, scan.angle(i), truth)) continue;
    Known& k = known[truth <= 2 ? 0 : 1];
    int samples = 0;
    const int returns = returns_over(stage, f, scan.angle(i), truth - 0.3, 0.3, &samples);
    ++k.beams;
    k.any += returns > 0;
    k.run += returns >= ScanOptions().min_run_px;
    k.samples += samples;
    k.returns += returns;
  }
}

// Floor one sample covers at a range (m), looking ahead.
double footprint(const SceneCamera& stage, double range) {
  const CameraModel& c = stage.world.rig.depth->camera.camera;
  return range * range / (c.T_body_camera.translation().z() * c.fy);
}

}  // namespace
