// Errors over relative poses that somebody checked by hand.
#pragma once

#include <filesystem>
#include <vector>

#include <lamina/pipeline/evaluation/trajectory_error.hpp>

namespace lamina {

/// Where the body was at `to`, as seen from where it was at `from`.
struct Relation {
  Timestamp from, to;
  SE3 T_from_to;
};

/// Lines `t1 t2 x y z roll pitch yaw` (s, m, rad), '#' comments. Throws lamina::Error naming file
/// and line for a line that cannot be read, or where there is none.
std::vector<Relation> read_relations(const std::filesystem::path& file);

struct RelationErrors {
  int without_pose = 0;  ///< relations whose times the path does not reach
  ErrorStatistics translation_m, rotation_deg;
  Relation worst;  ///< in translation
};

/// Of inv(relation) inv(P1) P2 [Kuemmerle2009]: lengths of its translation and of its rotation. A
/// path between poses at most `max_gap` seconds apart is interpolated.
RelationErrors relation_errors(const Trajectory& estimate, const std::vector<Relation>& relations,
                               double max_gap = 0.5);

}  // namespace lamina
