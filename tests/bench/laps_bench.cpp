// Memory of many laps of one building: what the mapper keeps after each.
//   laps_bench [LAPS]               default 50
//   laps_bench doubles FIRST LAST   two laps that do not know each other's walls, seeds FIRST to
//   LAST
// A made-up room driven round and round, depth camera and scanner; loops between laps and
// refinements as `lamina map --mode online` has them. Prints the heap (mallinfo2) and what is in
// it.
#include <malloc.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/backend/mapper/online_maintenance.hpp>
#include <lamina/models/error.hpp>

#include "backend/mapper/mapper_room.hpp"

using namespace lamina;

namespace {

constexpr int kFramesALap = 120;

// Heap in use, MB: arenas and mapped blocks.
double heap_mb() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd) / (1024.0 * 1024.0);
}

struct Kept {
  std::size_t keyframes = 0, observations = 0, loops = 0, planes = 0, pieces = 0, squares = 0,
              loose = 0, frames = 0;
  double heap = 0;
};

// `before`: what the bench itself has, MB.
Kept kept(const Mapper& mapper, double before) {
  Kept k;
  k.heap = heap_mb() - before;
  const MapState state = mapper.state();
  k.keyframes = state.graph.keyframes.size();
  k.observations = state.graph.plane_moments.size();
  k.loops = state.graph.loops.size();
  k.planes = state.graph.planes.size();
  for (const auto& [id, pieces] : state.outlines) k.pieces += pieces.size();
  k.squares = state.surfels.size();
  for (const auto& [id, points] : state.loose_body) k.loose += points.size();
  k.frames = state.frames.size();
  return k;
}

// Floor, and the foot of what stands on it.
void add_ground(Observations& o, made_up::Sensor& sensor) {
  made_up::add_floor(o, sensor);
  for (int k = 0; k < 100; ++k) {
    o.obstacle_points_body.emplace_back(3 + sensor.gauss(0.2), sensor.gauss(0.5), 0.2);
  }
}

void run(int laps) {
  const made_up::Drive drive(laps * kFramesALap, kFramesALap, 7);
  const auto room = made_up::make_room();
  made_up::Sensor sensor(8);
  const double before = heap_mb();
  Mapper mapper;
  mapper.keep_frames_in(std::filesystem::temp_directory_path());
  std::map<std::size_t, std::pair<KeyframeId, SE3>> places;  // of frames: keyframe, T_keyframe_body
  OnlineUpkeep upkeep;
  double second = 0;
  std::puts("  lap keyframes observations loops planes pieces squares  loose frames  heap MB");
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    Observations o = i % 3 == 2 ? sensor.scan(drive.truth[i], made_up::at_frame(i), room)
                                : sensor.depth(drive.truth[i], made_up::at_frame(i), room);
    if (i % 3 != 2) add_ground(o, sensor);
    const AddResult added =
        mapper.add(o, i == 0 ? drive.truth[0] : drive.increments[i - 1], drive.covariance);
    upkeep.added(added, mapper);
    constexpr std::size_t kEvery = 30;  // frames, some 2.5 m: as long as a submap
    if (i % kEvery == 0) {
      const Keyframe& at = mapper.graph().at(added.keyframe);
      const std::pair<KeyframeId, SE3> here{added.keyframe,
                                            at.T_map_body.inverse() * added.T_map_body};
      const auto earlier = places.find(i % kFramesALap);
      bool taken = false;
      if (earlier != places.end()) {
        const auto& [id, T_keyframe_body] = earlier->second;
        Vector6d e;
        for (int k = 0; k < 6; ++k) e(k) = sensor.gauss(k < 3 ? 0.01 : 0.002);
        const SE3 T = drive.truth[i % kFramesALap].inverse() * drive.truth[i] * SE3::exp(e);
        Matrix6d C = Matrix6d::Zero();
        C.diagonal() << Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(4e-6);
        taken = mapper.add_loop(id, added.keyframe, T_keyframe_body * T * here.second.inverse(), C);
      } else {
        places[i] = here;
      }
      if (upkeep.due(taken ? 1 : 0, mapper)) upkeep.refine(mapper);
    }
    if ((i + 1) % kFramesALap != 0) continue;
    const int lap = static_cast<int>((i + 1) / kFramesALap);
    if (lap > 5 && lap % 5 != 0) continue;
    const Kept k = kept(mapper, before);
    if (lap == 2) second = k.heap;
    std::printf("%5d %9zu %12zu %5zu %6zu %6zu %7zu %6zu %6zu %8.2f\n", lap, k.keyframes,
                k.observations, k.loops, k.planes, k.pieces, k.squares, k.loose, k.frames, k.heap);
    if (i + 1 == drive.truth.size() && second > 0)
      std::printf("the last over the second lap: %.2f\n", k.heap / second);
  }
}

void merge_doubles(unsigned first, unsigned last) {
  made_up::Doubles doubles;
  for (unsigned seed = first; seed <= last; ++seed) {
    Mapper mapper = made_up::doubled(seed, made_up::make_room_with_slab());
    doubles.refine(mapper);
  }
  std::printf(
      "%d planes stood twice, %d are left; %d panels merged into another, %d planes on none\n",
      doubles.before, doubles.left, doubles.wrong, doubles.strange);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 4 && std::strcmp(argv[1], "doubles") == 0) {
    merge_doubles(static_cast<unsigned>(std::atoi(argv[2])),
                  static_cast<unsigned>(std::atoi(argv[3])));
    return 0;
  }
  const int laps = argc > 1 ? std::atoi(argv[1]) : 50;
  run(laps > 0 ? laps : 50);
  return 0;
}
