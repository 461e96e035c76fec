// Floors that are no planes: a recorded world mapped with its ground as pieces, as one floor, and
// with surfels in the joint estimate.
//   swells_bench [--joint] DATASET ...   folders of `lamina simulate`; the front-end's motions as
//   they
//                                        are, no self-calibration; --joint: with surfels alone
// Times are of the processor.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/frontend/frontend.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/evaluation/trajectory_error.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sim/truth.hpp>

namespace lamina {
namespace {

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

std::string errors_of(const Trajectory& path, const Trajectory& truth) {
  const auto e = trajectory_error(path, truth);
  if (!e) return "-";
  return fmt::format("{:.1f}, {:.1f} mm, {:.2f} degrees", 1000 * e->ate_m.rmse,
                     1000 * e->ate_height_m.rmse, e->ate_deg.rmse);
}

// Root mean square of surfels' heights against the true ground under them, mm.
double layer_rms(const PlanarMap& map, const sim::TruthGrid& truth, const SE3& T_truth_map) {
  constexpr double kOther = 0.1;  // m: not this ground
  double squares = 0, count = 0;
  for (const Surfel& surfel : map.surfels) {
    const Eigen::Vector3d x = T_truth_map * surfel.center;
    const int i = static_cast<int>(std::floor((x.x() - truth.x0) / truth.resolution));
    const int j = static_cast<int>(std::floor((x.y() - truth.y0) / truth.resolution));
    if (i < 0 || j < 0 || i >= truth.width || j >= truth.height) continue;
    const double off = x.z() - static_cast<double>(truth.surface[truth.index(i, j)]);
    if (!(std::abs(off) < kOther)) continue;
    squares += off * off;
    ++count;
  }
  return 1000 * std::sqrt(squares / std::max(1.0, count));
}

void map_once(const std::string& folder, bool connect, bool joint) {
  const auto recording = open_recording(folder);
  FrontEndOptions front;
  front.floor.self_calibrate = false;
  FrontEnd front_end(front, recording->calibration());
  MapperOptions options;
  options.ground.enabled = connect;
  options.joint_surfels.enabled = joint;
  Mapper mapper(options);
  Diagnostics diagnostics;
  std::vector<double> keyframe_ms;
  while (const auto measurement = recording->next()) {
    const auto step = front_end.process(*measurement, diagnostics);
    if (!step) continue;
    const double begun = cpu_seconds();
    const AddResult added =
        mapper.add(step->observations, step->motion.T_from_to, step->motion.covariance);
    if (added.is_keyframe) keyframe_ms.push_back(1000 * (cpu_seconds() - begun));
  }
  const Trajectory truth = Trajectory::read_tum(folder + "/groundtruth.txt");
  const std::string online = errors_of(mapper.online_trajectory(), truth);
  const double before = cpu_seconds();
  mapper.refine();
  const double refine_s = cpu_seconds() - before;
  const PlanarMap map = mapper.map();
  const auto up = std::count_if(map.planes.begin(), map.planes.end(), [](const MapPlane& plane) {
    return plane.plane_map.normal().z() > 0.8;
  });
  const auto world = sim::read_truth(folder);
  const auto error = trajectory_error(mapper.trajectory(), truth);
  double sum = 0;
  for (const double ms : keyframe_ms) sum += ms;
  fmt::print("| {} | {} | {} | {} | {} | {:.1f} | {:.1f} | {:.1f} |\n", folder,
             joint     ? "joint surfels"
             : connect ? "one floor"
                       : "pieces",
             errors_of(mapper.trajectory(), truth), online, up,
             world && error ? layer_rms(map, world->grid, error->T_reference_estimate) : 0.0,
             refine_s, sum / std::max(1.0, static_cast<double>(keyframe_ms.size())));
  std::fflush(stdout);
}

}  // namespace
}  // namespace lamina

int main(int argc, char** argv) {
  fmt::print(
      "| world | ground | offline: ATE, height, angle | online | planes facing up | surfels' "
      "height "
      "mm rms | refine s | keyframe ms |\n|---|---|---|---|---|---|---|---|\n");
  bool joint_alone = false;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--joint") {
      joint_alone = true;
      continue;
    }
    if (!joint_alone) {
      lamina::map_once(argv[i], false, false);
      lamina::map_once(argv[i], true, false);
    }
    lamina::map_once(argv[i], true, true);
  }
}
