// Scenes with a camera, and the scores the floor's table is made of; part of floor_bench.cpp alone.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <string>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/depth/floor_memory.hpp>
#include <lamina/frontend/depth/leveling.hpp>
#include <lamina/sim/sim_recording.hpp>

#include "bench/scene_camera.hpp"

using namespace lamina;

namespace {

// A scene's camera that knows which planes are one.
struct Stage : SceneCamera {
  Stage(const std::string& scene, const sim::Parameters& parameters, std::uint64_t seed)
      : SceneCamera(scene, parameters, seed) {
    group_coplanar();
  }

  // Planes of the scene that lie in one plane count as one: whole planes are wanted, and the fronts
  // of two boxes in line are one plane.
  void group_coplanar() {
    const auto& planes = world.scene.planes();
    for (std::size_t i = 0; i < planes.size(); ++i) {
      group.push_back(static_cast<int>(i));
      for (std::size_t j = 0; j < i; ++j) {
        const Plane& a = planes[i].plane_map;
        const Plane& b = planes[j].plane_map;
        const bool same =
            a.normal().dot(b.normal()) > 1 - 1e-9 && std::abs(a.rho() - b.rho()) < 1e-6;
        const bool back =
            a.normal().dot(b.normal()) < -1 + 1e-9 && std::abs(a.rho() + b.rho()) < 1e-6;
        if (same || back) {
          group.back() = group[j];
          break;
        }
      }
    }
  }
  int plane_id(int u, int v) const {
    const int surface = truth.surface[truth.index(u, v)];
    return surface < 0 ? -1 : caster.plane_of(surface);
  }

  std::vector<int> group;  ///< plane -> first plane it is coplanar with
};

double quantile(std::vector<double> v, double q) {
  if (v.empty()) return 0;
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, static_cast<std::size_t>(q * static_cast<double>(v.size())))];
}

SE3 pose_on_path(const sim::World& world, double s) {
  const double t = s * world.path.duration();
  return world.path.at(t);
}

// ---------------------------------------------------------------------------------- speed
void print_times(const char* name, std::vector<FloorStageTimes>& times) {
  const auto column = [&](auto get, double q) {
    std::vector<double> v;
    for (const auto& t : times) v.push_back(get(t));
    return quantile(v, q);
  };
  const auto stage = [](const FloorStageTimes& t) { return t.plane_stage_ms(); };
  const auto total = [](const FloorStageTimes& t) { return t.total_ms(); };
  std::printf("%-14s plane stage %.2f ms (min %.2f, p99 %.2f) chain %.2f (min %.2f)", name,
              column(stage, 0.5), column(stage, 0), column(stage, 0.99), column(total, 0.5),
              column(total, 0));
  std::printf(
      "  = %.2f disparity + %.2f blocks + %.2f planes + %.2f pixels + %.2f output + %.2f surface\n",
      column([](const auto& t) { return t.disparity_ms; }, 0.5),
      column([](const auto& t) { return t.blocks_ms; }, 0.5),
      column([](const auto& t) { return t.planes_ms; }, 0.5),
      column([](const auto& t) { return t.refine_ms; }, 0.5),
      column([](const auto& t) { return t.output_ms; }, 0.5),
      column([](const auto& t) { return t.surface_ms; }, 0.5));
}

// Of every frame the least time of several: what frames hold, without the machine's share.
void print_least(const char* name, const std::vector<double>& stage,
                 const std::vector<double>& chain) {
  const auto print = [](const char* what, const std::vector<double>& least) {
    const double median = quantile(least, 0.5), p99 = quantile(least, 0.99);
    std::printf(" %s median %.2f p99 %.2f ms, %.2f times,", what, median, p99, p99 / median);
  };
  std::printf("%-14s least of each frame:", name);
  print("stage", stage);
  print("chain", chain);
  std::printf(" %zu frames\n", stage.size());
}

// A recording several times over.
void bench_least(const char* folder, int passes) {
  std::vector<double> stage, chain;
  for (int pass = 0; pass < passes; ++pass) {
    const auto recording = open_recording(folder);
    FloorFrontend frontend;
    std::size_t i = 0;
    while (const auto m = recording->next()) {
      const DepthFrame* f = std::get_if<DepthFrame>(&*m);
      if (!f) continue;
      const FloorStageTimes times = frontend.process(*f).times;
      if (pass == 0) {
        stage.push_back(times.plane_stage_ms());
        chain.push_back(times.total_ms());
      }
      stage[i] = std::min(stage[i], times.plane_stage_ms());
      chain[i] = std::min(chain[i], times.total_ms());
      ++i;
    }
  }
  print_least(folder, stage, chain);
}

// Each of eight frames 125 times. The slowest frame's median tells what content costs; what p99 is
// above it is the machine's.
void bench_time() {
  for (const char* scene : {"flat", "room", "steps", "stairs_down"}) {
    Stage stage(scene, {}, 1);
    FloorFrontend frontend;
    std::vector<FloorStageTimes> times;
    double slowest = 0;
    std::vector<double> least_stage, least_chain;
    for (int i = 0; i < 8; ++i) {
      std::vector<double> stages, chains;
      const DepthFrame f =
          stage.frame(pose_on_path(stage.world, i / 8.0), static_cast<std::uint64_t>(i));
      for (int k = 0; k < 125; ++k) {  // p99 of 1,000
        times.push_back(frontend.process(f).times);
        stages.push_back(times.back().plane_stage_ms());
        chains.push_back(times.back().total_ms());
      }
      slowest = std::max(slowest, quantile(stages, 0.5));
      least_stage.push_back(quantile(stages, 0));
      least_chain.push_back(quantile(chains, 0));
    }
    print_times(scene, times);
    std::printf("%-14s median of the slowest of eight frames %.2f ms\n", "", slowest);
    print_least("", least_stage, least_chain);
  }
}

// ---------------------------------------------------------------------------------- planes
struct Score {
  int truth = 0, matched_truth = 0, found = 0, matched_found = 0;
};

// Intersection over union of at least 80 % between a found plane's pixels and a true plane's.
Score score_planes(const Stage& stage, const DepthFrame& f, const FloorResult& r, int least,
                   bool verbose) {
  std::map<int, int> truth_px, found_px;
  std::map<std::pair<int, int>, int> both;
  // Keys of truth: a plane, or 10000 + its group of coplanar planes.
  for (int v = 0; v < f.height(); ++v) {
    for (int u = 0; u < f.width(); ++u) {
      if (f.raw_at(u, v) == 0) continue;
      const int t = stage.plane_id(u, v), k = r.plane_at(u, v, f.width());
      if (k >= 0) ++found_px[k];
      if (t < 0) continue;
      const int g = 10000 + stage.group[static_cast<std::size_t>(t)];
      ++truth_px[t];
      ++truth_px[g];
      if (k >= 0) ++both[{t, k}];
      if (k >= 0) ++both[{g, k}];
    }
  }
  Score s;
  for (const auto& [t, n] : truth_px) {
    if (n < least || t >= 10000) continue;
    ++s.truth;
    const int g = 10000 + stage.group[static_cast<std::size_t>(t)];
    bool hit = false;
    int best = 0, best_k = -1;
    for (const auto& [key, m] : both) {
      if (key.first != t && key.first != g) continue;
      hit |= m >= 0.8 * (truth_px[key.first] + found_px[key.second] - m);
      if (key.first != t) continue;
      if (m > best) {
        best = m;
        best_k = key.second;
      }
    }
    if (verbose && !hit) {
      std::printf("    missed %-22s %6d px, best %d (its %d)\n",
                  stage.world.scene.planes()[static_cast<std::size_t>(t)].name.c_str(), n, best,
                  best_k >= 0 ? found_px[best_k] : 0);
    }
    s.matched_truth += hit;
  }
  for (const auto& [k, n] : found_px) {
    if (n < least) continue;
    ++s.found;
    bool hit = false;
    for (const auto& [key, m] : both) {
      hit |= key.second == k && m >= 0.8 * (n + truth_px[key.first] - m);
    }
    if (verbose && !hit) {
      std::printf("    false  plane %d %d px slope %.1f height %.2f\n", k, n,
                  r.planes[static_cast<std::size_t>(k)].slope / kDegree,
                  r.planes[static_cast<std::size_t>(k)].height);
    }
    s.matched_found += hit;
  }
  return s;
}

void bench_planes(bool verbose) {
  Score all;
  for (const char* scene : {"room", "steps", "stairs_down", "flat"}) {
    Score sum;
    for (int i = 0; i < 20; ++i) {
      Stage stage(scene, {}, static_cast<std::uint64_t>(i) + 1);
      FloorFrontend frontend;
      const DepthFrame f =
          stage.frame(pose_on_path(stage.world, i / 20.0), static_cast<std::uint64_t>(i));
      const FloorResult r = frontend.process(f);
      const Score s = score_planes(stage, f, r, 1000, verbose);
      sum.truth += s.truth;
      sum.matched_truth += s.matched_truth;
      sum.found += s.found;
      sum.matched_found += s.matched_found;
    }
    std::printf("%-14s recall %.3f (%d of %d) precision %.3f (%d of %d)\n", scene,
                sum.matched_truth / std::max(1.0, 1.0 * sum.truth), sum.matched_truth, sum.truth,
                sum.matched_found / std::max(1.0, 1.0 * sum.found), sum.matched_found, sum.found);
    all.truth += sum.truth;
    all.matched_truth += sum.matched_truth;
    all.found += sum.found;
    all.matched_found += sum.matched_found;
  }
  std::printf("%-14s recall %.3f precision %.3f\n", "all",
              all.matched_truth / std::max(1.0, 1.0 * all.truth),
              all.matched_found / std::max(1.0, 1.0 * all.found));
}

// Share of a surface's pixels whose label is not the floor's but its own.
void bench_apart() {
  std::map<std::string, std::vector<double>> share;
  for (int i = 0; i < 20; ++i) {
    Stage stage("steps", {}, static_cast<std::uint64_t>(i) + 1);
    FloorFrontend frontend;
    const DepthFrame f =
        stage.frame(pose_on_path(stage.world, i / 20.0), static_cast<std::uint64_t>(i));
    const FloorResult r = frontend.process(f);
    std::map<int, std::map<int, int>> votes;
    std::map<int, int> total;
    for (int v = 0; v < f.height(); ++v) {
      for (int u = 0; u < f.width(); ++u) {
        const int t = stage.plane_id(u, v);
        if (t < 0 || f.raw_at(u, v) == 0) continue;
        ++total[t];
        ++votes[t][r.plane_at(u, v, f.width())];
      }
    }
    for (const auto& [t, n] : total) {
      const std::string& name = stage.world.scene.planes()[static_cast<std::size_t>(t)].name;
      if (n < 1000 ||
          (name.find("top") == std::string::npos && name.find("ramp") == std::string::npos))
        continue;
      int best = 0;
      for (const auto& [k, m] : votes[t]) {
        if (k >= 0 && k != r.dominant) best = std::max(best, m);
      }
      share[name].push_back(1.0 * best / n);
    }
  }
  for (const auto& [name, v] : share) {
    double mean = 0;
    for (double x : v) mean += x / static_cast<double>(v.size());
    std::printf("%-22s own pixels mean %.3f least %.3f (%zu frames)\n", name.c_str(), mean,
                quantile(v, 0), v.size());
  }
}

// ---------------------------------------------------------------------------------- tilt
// Where the tilt of a single frame's floor comes from: frames of one place share the sensor's slow
// distortion, noise is each frame's own. One effect of the sensor after the other taken away.
void bench_tilt(int frames) {
  constexpr int kPerPlace = 20;
  const std::pair<const char*, sim::Parameters> kSensors[] = {
      {"all effects", {}},
      {"no slow distortion", {{"effects.distortion", "false"}}},
      {"no quantisation", {{"effects.quantise", "false"}}},
      {"no lateral jitter", {{"effects.lateral", "false"}}},
      {"no noise", {{"effects.noise", "false"}}}};
  for (const auto& [name, parameters] : kSensors) {
    double worst = 0, shared = 0, own = 0;
    int worst_frame = -1, over = 0, count = 0;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (int i = 0; i + kPerPlace <= frames; i += kPerPlace) {
      Stage stage("flat", parameters, static_cast<std::uint64_t>(i) + 1);
      std::vector<Eigen::Vector2d> tilts;
      Eigen::Vector2d middle = Eigen::Vector2d::Zero();
      for (int k = 0; k < kPerPlace; ++k) {
        const double roll = std::sin((i + k) * 1.7) * kDegree;
        const double pitch = std::cos((i + k) * 2.3) * kDegree;
        FloorFrontend frontend;
        const FloorResult r =
            frontend.process(stage.frame(SE3(), static_cast<std::uint64_t>(k), roll, pitch));
        if (!r.floor_camera) continue;
        const Leveling l = leveling_of(stage.T_body_camera(), *r.floor_camera);
        tilts.emplace_back(l.roll / kDegree, l.pitch / kDegree);
        middle += tilts.back();
        over += tilts.back().norm() > 0.05;
        if (tilts.back().norm() <= worst) continue;
        worst = tilts.back().norm();
        worst_frame = i + k;
      }
      if (tilts.empty()) continue;
      middle /= static_cast<double>(tilts.size());
      mean += middle * static_cast<double>(tilts.size());
      shared += middle.squaredNorm() * static_cast<double>(tilts.size());
      for (const Eigen::Vector2d& t : tilts) own += (t - middle).squaredNorm();
      count += static_cast<int>(tilts.size());
    }
    const double n = std::max(1, count);
    std::printf(
        "tilt, %-19s: worst %.4f deg (frame %d of %d), %d frames above 0.05; mean roll %+.4f pitch "
        "%+.4f; rms of places %.4f, of frames about their place %.4f deg\n",
        name, worst, worst_frame, count, over, mean.x() / n, mean.y() / n, std::sqrt(shared / n),
        std::sqrt(own / n));
  }
}

}  // namespace
