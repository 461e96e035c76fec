// What the steps of one Mapper::add hand to each other. Private to mapper*.cpp.
#pragma once

#include <optional>
#include <vector>

#include <lamina/backend/mapper/mapper.hpp>

namespace lamina {

/// The options for the one candidate that the front-end followed to this scan: it is believed to be
/// the same plane within the chi-squared gate, the prediction being too unsure for the other gates
/// where a fast scanner meets planes whose tilt is not known yet. 60 degrees stay.
AssociationOptions followed(const AssociationOptions& options);

struct Mapper::Step {
  const Observations& observations;
  SE3 T_prev_body;
  Matrix6d increment_covariance;
  std::vector<PlaneEvidence> evidence = {};  // body frame
  std::vector<std::int64_t> tracks = {};     // the front-end's, by evidence; -1: none
  Relative odometry = {}, estimate = {};
  SE3 T_map_body = {};  // predicted
  std::vector<std::optional<std::size_t>> tentative =
      {};  // by evidence: the forming plane it is of
  AddResult result = {};
};

}  // namespace lamina
