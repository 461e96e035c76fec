// Gathers trajectory, planes and grid of a map and of the truth.
#include <lamina/pipeline/evaluation/evaluation.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/io/grid_files.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/io/path_files.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sim/truth.hpp>

namespace lamina {
namespace {

namespace fs = std::filesystem;

std::vector<ReferencePlane> reference_planes(const sim::Truth& truth) {
  std::vector<ReferencePlane> planes;
  for (const sim::TruthPlane& plane : truth.planes) {
    planes.push_back({plane.id, plane.plane_map, plane.outline_map,
                      plane.sightings >= 3 ? plane.hits : std::int64_t{0}});
  }
  return planes;
}

NavigabilityGrid true_grid(const sim::TruthGrid& truth) {
  NavigabilityGrid grid(truth.resolution);
  for (int j = 0; j < truth.height; ++j) {
    for (int i = 0; i < truth.width; ++i) {
      const std::size_t k = truth.index(i, j);
      if (std::isnan(truth.navigability[k])) continue;
      const Eigen::Vector2d center(truth.x0 + (i + 0.5) * truth.resolution,
                                   truth.y0 + (j + 0.5) * truth.resolution);
      grid.at_or_new(cell_of(center, truth.resolution)) = {truth.surface[k], 0.0f,
                                                           truth.navigability[k], 1.0f};
    }
  }
  return grid;
}

void compare_with_simulation(const fs::path& map, const sim::Truth& truth,
                             const Trajectory& path_map, const SE3& T_reference_map,
                             const std::optional<SE3>& T_reference_datum, Evaluation& evaluation) {
  if (fs::exists(map / "planes.json")) {
    evaluation.planes =
        plane_errors(io::read_planes_json(map / "planes.json"), reference_planes(truth),
                     T_reference_map, {}, T_reference_datum);
  }
  if (truth.grid.width <= 0) return;
  const NavigabilityGrid ground = true_grid(truth.grid);
  if (fs::exists(map / "grid" / "grid.yaml")) {
    evaluation.grid =
        grid_errors(io::read_grid(map / "grid").grid, ground, T_reference_map, path_map);
  }
  if (fs::exists(map / "path.csv")) {
    evaluation.path = path_errors(io::read_path_csv(map / "path.csv"), ground, T_reference_map);
  }
}

}  // namespace

Trajectory paired_by_index(const Trajectory& estimate, const Trajectory& reference) {
  Trajectory paired;
  for (std::size_t i = 0; i < std::min(estimate.size(), reference.size()); ++i) {
    paired.add(estimate[i].stamp, reference[i].pose);
  }
  return paired;
}

SE3 align_poses(const Trajectory& estimate, const Trajectory& reference, Alignment alignment) {
  if (alignment == Alignment::kNone) return SE3();
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  std::optional<Eigen::Vector4d> first;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> pairs;
  for (const auto& [stamp, pose] : estimate) {
    const auto truth = reference.at(stamp, 0.5);
    if (!truth) continue;
    const Eigen::Vector4d q = (truth->so3() * pose.so3().inverse()).quaternion().coeffs();
    if (!first) first = q;
    sum += q.dot(*first) < 0 ? Eigen::Vector4d(-q) : q;
    pairs.emplace_back(truth->translation(), pose.translation());
  }
  if (pairs.empty()) return SE3();
  const SO3 mean{Eigen::Quaterniond(sum)};
  const SO3 R = alignment == Alignment::kYaw ? SO3::rot_z(mean.yaw()) : mean;
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  for (const auto& [a, b] : pairs) t += (a - R * b) / static_cast<double>(pairs.size());
  return SE3(R, t);
}

std::optional<SE3> align_first_pose(const Trajectory& estimate, const Trajectory& reference) {
  for (const auto& [stamp, pose] : estimate) {
    if (const auto truth = reference.at(stamp, 0.5)) return *truth * pose.inverse();
  }
  return std::nullopt;
}

namespace {

// The reference at the estimate's stamps, or at its own.
Trajectory read_reference(const fs::path& poses, const Trajectory& estimate,
                          Evaluation& evaluation) {
  const Trajectory reference = Trajectory::read_tum(poses);
  if (!evaluation.by_index) return reference;
  if (estimate.size() != reference.size()) {
    evaluation.remarks.push_back("by index: " + std::to_string(estimate.size()) +
                                 " poses of the map against " + std::to_string(reference.size()) +
                                 " of the reference, compared as far as the shorter goes");
  }
  return paired_by_index(estimate, reference);
}

// The path of the marker that the reference follows; the body's own where nothing is fitted.
Trajectory path_to_compare(const Trajectory& estimate, const Trajectory& reference,
                           const MarkerFitOptions& options, Evaluation& evaluation) {
  if (!options.lever && !options.clock) return estimate;
  evaluation.marker = fit_marker(estimate, reference, options);
  return evaluation.marker ? evaluation.marker->of_marker(estimate) : estimate;
}

void compare_with_truth(const fs::path& map, const fs::path& truth, const Trajectory& estimate,
                        const MarkerFitOptions& marker, Evaluation& evaluation) {
  if (!fs::exists(truth)) {
    throw Error(truth.string() + ": does not exist, expected a dataset folder or a TUM file");
  }
  const fs::path poses = fs::is_directory(truth) ? truth / "groundtruth.txt" : truth;
  SE3 T_reference_map;
  std::optional<SE3> T_reference_datum;
  if (!fs::exists(poses)) {
    evaluation.remarks.push_back(poses.string() + " does not exist: no trajectory compared");
  } else {
    const Trajectory reference = read_reference(poses, estimate, evaluation);
    const Trajectory path = path_to_compare(estimate, reference, marker, evaluation);
    evaluation.trajectory = trajectory_error(path, reference, 0.5, evaluation.alignment);
    if (!evaluation.trajectory) {
      throw Error(poses.string() + ": found no times that meet those of the map's trajectory, " +
                  "expected the reference of the same recording");
    }
    T_reference_map = align_poses(estimate, reference, evaluation.alignment);
    T_reference_datum = align_first_pose(estimate, reference);
  }
  if (!fs::is_directory(truth)) return;
  if (const auto known = sim::read_truth(truth)) {
    compare_with_simulation(map, *known, estimate, T_reference_map, T_reference_datum, evaluation);
  } else {
    evaluation.remarks.push_back("no truth.yaml: planes and grid not compared");
  }
}

}  // namespace

Evaluation evaluate(const fs::path& map, const fs::path& truth, const EvaluationOptions& options) {
  Evaluation evaluation;
  evaluation.alignment = options.alignment;
  evaluation.by_index = options.by_index;
  const Trajectory estimate = Trajectory::read_tum(map / "trajectory.txt");
  if (!options.relations.empty()) {
    evaluation.relations = relation_errors(estimate, read_relations(options.relations));
    if (evaluation.relations->translation_m.count == 0) {
      throw Error(options.relations.string() + ": found no times of the map's trajectory, " +
                  "expected relations of the same recording");
    }
  }
  if (!truth.empty()) compare_with_truth(map, truth, estimate, options.marker, evaluation);
  if (fs::exists(map / "planes.json")) {
    const auto planes = io::read_planes_json(map / "planes.json");
    evaluation.map_planes = planes.size();
    evaluation.near_pairs = near_pairs(planes);
  }
  if (!evaluation.trajectory && !evaluation.planes && !evaluation.grid && !evaluation.relations) {
    throw Error(truth.string() +
                ": found neither groundtruth.txt nor truth.yaml, expected one of them at least");
  }
  return evaluation;
}

}  // namespace lamina
