// One factorisation, then a short solve for each row asked for.
#include <lamina/backend/solver/covariance.hpp>

#include <array>

#include <lamina/backend/graph/datum.hpp>
#include <lamina/backend/solver/native/normal_equations.hpp>

namespace lamina {
namespace {

/// In place of no information at all: a sigma of 1e3 m or rad says "unknown" and stays finite.
constexpr double kVagueInformation = 1e-6;

template <class States, class Ids>
std::vector<std::size_t> indices_of(const Graph& graph, const States& states, const Ids& ids) {
  std::vector<std::size_t> indices;
  for (const auto id : ids) {
    indices.push_back(static_cast<std::size_t>(&graph.at(id) - states.data()));
  }
  return indices;
}

// By as little damping as that takes.
void factorize(NormalEquations& equations, Covariances& result) {
  const Eigen::VectorXd diagonal = equations.diagonal();
  for (const double damping : {0.0, 1e-12, 1e-9, 1e-6}) {
    Eigen::VectorXd added = damping * diagonal;
    int silent = 0;  // rows no factor speaks of
    for (Eigen::Index i = 0; i < added.size(); ++i) {
      if (diagonal(i) > 0) continue;
      added(i) = kVagueInformation;
      ++silent;
    }
    if (!equations.factorize(added)) continue;
    result.valid = true;
    result.weak_directions = silent + equations.weak_pivots(std::max(1e-11, 10 * damping));
    break;
  }
}

}  // namespace

Covariances covariances(const Graph& original, const CovarianceRequest& request) {
  Covariances result;
  if (!original.problems().empty()) return result;
  std::optional<Graph> copy;  // only where a keyframe has to be held
  const std::vector<KeyframeId> held = keyframes_without_datum(original);
  if (!held.empty()) {
    copy = original;
    for (const KeyframeId id : held) copy->at(id).fixed = true;
  }
  const Graph& graph = copy ? *copy : original;
  NormalEquations equations(graph);
  equations.linearize();
  factorize(equations, result);
  if (!result.valid) return result;
  const auto poses = indices_of(graph, graph.keyframes, request.keyframes);
  result.keyframes = equations.pose_covariances(poses);
  if (request.joint_keyframes) result.joint_keyframes = equations.joint_pose_covariance(poses);
  result.planes = equations.plane_covariances(indices_of(graph, graph.planes, request.planes));
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto& [a, b] : request.plane_pairs) {
    const auto pair = indices_of(graph, graph.planes, std::array{a, b});
    pairs.emplace_back(pair[0], pair[1]);
  }
  result.plane_pairs = equations.plane_pair_covariances(pairs);
  if (!request.extrinsics.empty()) {
    result.joint_extrinsics = equations.joint_extrinsics_covariance(
        indices_of(graph, graph.extrinsics, request.extrinsics));
  }
  result.surfels = equations.surfel_covariances(indices_of(graph, graph.surfels, request.surfels));
  return result;
}

void store_covariances(Graph& graph) {
  CovarianceRequest request;
  for (const auto& plane : graph.planes) {
    if (plane.active) request.planes.push_back(plane.id);
  }
  for (const auto& surfel : graph.surfels) request.surfels.push_back(surfel.id);
  const Covariances found = covariances(graph, request);
  if (!found.valid) return;
  for (std::size_t i = 0; i < request.planes.size(); ++i) {
    graph.at(request.planes[i]).covariance = found.planes[i];
  }
  for (std::size_t i = 0; i < request.surfels.size(); ++i) {
    graph.at(request.surfels[i]).covariance = found.surfels[i];
  }
}

}  // namespace lamina
