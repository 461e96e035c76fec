// Small maps of blocks of a drive, each by itself: evidence of what is wrong with wheels and camera
// that can be left out block by block.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/mapper/mapper_options.hpp>
#include <lamina/frontend/frontend.hpp>
#include <lamina/models/adoption.hpp>

namespace lamina {

/// What a small map says, its parameters zero before; nullopt where it says nothing.
using EvidenceOfMap = std::function<std::optional<QuadraticBlock>(const Graph&)>;

/// Cuts the steps into a dozen blocks (of no less than AdoptionOptions::block_s), maps each by
/// itself (quick_map(), wheels as they are) and asks what the map says. Walls that blocks share are
/// not shared here: drift between them is nobody's evidence.
std::vector<QuadraticBlock> evidence_by_blocks(const std::vector<Step>& steps,
                                               const MapperOptions& options,
                                               const EvidenceOfMap& evidence,
                                               const std::function<bool()>& ended);

/// The evidence of an estimate with this prior information, without the prior.
QuadraticBlock without_prior(const Eigen::VectorXd& value, const Eigen::MatrixXd& covariance,
                             const Eigen::MatrixXd& prior);

}  // namespace lamina
