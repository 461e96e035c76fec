// What the steps of one Mapper::add hand to each other. Private to mapper*.cpp.
#pragma once

#include <optional>
#include <vector>

#include <lamina/backend/mapper.hpp>

namespace lamina {

struct Mapper::Step {
  const Observations& observations;
  SE3 T_prev_body;
  Matrix6d increment_covariance;
  std::vector<PlaneEvidence> evidence = {};  // body frame
  Relative odometry = {}, estimate = {};
  SE3 T_map_body = {};  // predicted
  std::vector<std::optional<std::size_t>> tentative =
      {};  // by evidence: the forming plane it is of
  AddResult result = {};
};

}  // namespace lamina
