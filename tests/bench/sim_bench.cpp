// Depth frames, scans and stereo pairs a second on one core, for a scene of 50 planes.
#include <cstdio>
#include <ctime>
#include <functional>

#include <lamina/sim/sim_recording.hpp>
#include <lamina/sim/stereo.hpp>

namespace {

using namespace lamina;
using namespace lamina::sim;

/// Seconds of this thread's processor time of the quickest of `repetitions` calls.
double quickest(int repetitions, const std::function<void(int)>& call) {
  double best = 1e9;
  for (int i = 0; i < repetitions; ++i) {
    timespec start{}, stop{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &start);
    call(i);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &stop);
    best = std::min(best, static_cast<double>(stop.tv_sec - start.tv_sec) +
                              1e-9 * static_cast<double>(stop.tv_nsec - start.tv_nsec));
  }
  return best;
}

/// A furnished hall: shell of 6 planes, 7 boxes of 6 and a ground for the rest.
Scene fifty_planes() {
  Scene scene;
  scene.add_ground("floor", PlaneLabel::kFloor, {-5, -4, 5, 4}, 0);
  scene.add_wall("a", {-5, -4}, {5, -4}, 0, 3);
  scene.add_wall("b", {5, -4}, {5, 4}, 0, 3);
  scene.add_wall("c", {5, 4}, {-5, 4}, 0, 3);
  scene.add_wall("d", {-5, 4}, {-5, -4}, 0, 3);
  scene.add_polygon("ceiling", PlaneLabel::kCeiling,
                    {{-5, -4, 3}, {-5, 4, 3}, {5, 4, 3}, {5, -4, 3}});
  for (int i = 0; i < 7; ++i) {
    scene.add_box("box" + std::to_string(i),
                  SE3::planar(1 + 0.5 * i, (i % 2 == 0 ? 1 : -1) * (0.6 + 0.3 * i), 0.2 * i),
                  {0.5, 0.7, 0.2 + 0.15 * i});
  }
  scene.add_rectangle("board", PlaneLabel::kOther, {4.9, -1, 1}, {0, 2, 0}, {0, 0, 1});
  scene.add_rectangle("panel", PlaneLabel::kOther, {0, 3.9, 1}, {-2, 0, 0}, {0, 0, 1});
  return scene;
}

}  // namespace

int main() {
  const Scene scene = fifty_planes();
  const Caster caster(scene);
  const SE3 T_map_camera = mount_camera({-4, 0, 0.8}, 0, 0.2, 0);
  std::printf(
      "%zu planes, 640 x 480 pixels, 541 beams; processor time of one thread, quickest of many\n",
      scene.planes().size());
  const auto report = [](const char* what, double seconds) {
    std::printf("%-34s %9.3f ms %10.0f a second\n", what, 1e3 * seconds, 1 / seconds);
  };
  const DepthCamera camera = kinect_camera(SE3());
  const DepthRenderer ideal(caster, camera, DepthEffects::none(), 1);
  const DepthRenderer kinect(caster, camera, DepthEffects(), 1);
  report("exact depth image", quickest(60, [&](int) { ideal.truth(T_map_camera); }));
  report("depth frame, no effects", quickest(60, [&](int i) {
           ideal.render(T_map_camera, {}, static_cast<std::uint64_t>(i));
         }));
  report("depth frame, all Kinect effects", quickest(60, [&](int i) {
           kinect.render(T_map_camera, {}, static_cast<std::uint64_t>(i));
         }));
  const LidarSimulator lidar(caster, {}, {}, {}, 1);
  const SE3 T_map_lidar = SE3::from_translation({-4, 0, 0.3});
  report("scan, all effects", quickest(300, [&](int i) {
           lidar.render(T_map_lidar, {}, static_cast<std::uint64_t>(i));
         }));
  StereoCamera pair;
  pair.camera = camera.camera;
  pair.baseline = 0.12;
  const StereoRenderer stereo(caster, pair, 2, 1);
  report("stereo pair", quickest(3, [&](int i) {
           stereo.render(T_map_camera, {}, static_cast<std::uint64_t>(i));
         }));
  return 0;
}
