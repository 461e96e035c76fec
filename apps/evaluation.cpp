// Gathers trajectory, planes and grid of a map and of the truth.
#include <lamina/apps/evaluation.hpp>

#include <lamina/io/grid_files.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {
namespace fs = std::filesystem;

Evaluation evaluate(const fs::path& map, const fs::path& truth) {
  Evaluation evaluation;
  if (!fs::exists(truth)) {
    throw Error(truth.string() + ": does not exist, expected a dataset folder or a TUM file");
  }
  const Trajectory estimate = Trajectory::read_tum(map / "trajectory.txt");
  const fs::path poses = fs::is_directory(truth) ? truth / "groundtruth.txt" : truth;
  if (!fs::exists(poses)) {
    evaluation.remarks.push_back(poses.string() + " does not exist: no trajectory compared");
  } else {
    evaluation.trajectory = trajectory_error(estimate, Trajectory::read_tum(poses));
    if (!evaluation.trajectory) {
      throw Error(poses.string() + ": found no times that meet those of the map's trajectory, " +
                  "expected the reference of the same recording");
    }
  }
  return evaluation;
}

}  // namespace lamina::apps
