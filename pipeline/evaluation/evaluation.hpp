// What `lamina evaluate` compares, prints and writes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lamina/pipeline/evaluation/grid_error.hpp>
#include <lamina/pipeline/evaluation/marker_fit.hpp>
#include <lamina/pipeline/evaluation/plane_error.hpp>
#include <lamina/pipeline/evaluation/relation_error.hpp>
#include <lamina/pipeline/evaluation/trajectory_error.hpp>

namespace lamina {

struct Evaluation {
  std::optional<TrajectoryError> trajectory;
  Alignment alignment = Alignment::kSe3;  ///< of trajectory->ate_m, planes and grid
  bool by_index = false;
  std::optional<MarkerFit> marker;  ///< fitted before trajectory errors were taken
  std::optional<RelationErrors> relations;
  std::optional<PlaneErrors> planes;
  std::optional<GridErrors> grid;
  std::optional<PathErrors> path;  ///< of DIR/path.csv, where there is one
  /// Map planes, and pairs of them that look like one wall drawn twice (near_pairs()).
  std::size_t map_planes = 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> near_pairs;
  std::vector<std::string> remarks;  ///< what could not be compared, and why
};

struct EvaluationLimits {
  std::optional<double> max_ate_m, max_rpe_m, max_plane_rho_m, max_plane_angle_deg, max_false_free;
  std::optional<int> max_missed;
};

struct EvaluationOptions {
  Alignment alignment = Alignment::kSe3;
  bool by_index = false;            ///< pose by pose in order, whatever the reference's stamps
  std::filesystem::path relations;  ///< of read_relations(); empty: none
  MarkerFitOptions marker;          ///< a reference of a marker on the robot, by its own clock
};

/// `map`: an output folder; `truth`: a dataset folder with groundtruth.txt (and truth.yaml), a TUM
/// file, or empty. Throws lamina::Error when a file is absent or damaged, or nothing can be
/// compared.
Evaluation evaluate(const std::filesystem::path& map, const std::filesystem::path& truth,
                    const EvaluationOptions& options = {});

/// The reference's poses at the estimate's stamps, one by one, as far as the shorter goes.
Trajectory paired_by_index(const Trajectory& estimate, const Trajectory& reference);

/// T_reference_map by the mean rotation and offset over whole poses: an alignment that a straight
/// path determines, too; of kYaw the turn about z. Identity when no stamps meet.
SE3 align_poses(const Trajectory& estimate, const Trajectory& reference,
                Alignment alignment = Alignment::kSe3);

/// T_reference_map that lays the first pose whose stamp the reference has on the true one; nullopt
/// when no stamps meet.
std::optional<SE3> align_first_pose(const Trajectory& estimate, const Trajectory& reference);

std::string to_text(const Evaluation& evaluation);
void write_evaluation(const std::filesystem::path& file, const Evaluation& evaluation);
/// One line for each limit that is exceeded or cannot be checked.
std::vector<std::string> exceeded(const Evaluation& evaluation, const EvaluationLimits& limits);

}  // namespace lamina
