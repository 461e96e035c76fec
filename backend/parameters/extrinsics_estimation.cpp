// The graph with its sensors free, against the graph without.
#include <lamina/backend/parameters/extrinsics_estimation.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include <lamina/backend/solver/covariance.hpp>

namespace lamina {
namespace {

bool is_finite(const RefineResult& result) {
  return result.status != SolveStatus::kInvalidInput && result.status != SolveStatus::kCancelled;
}

// Of doubtful factors each no more than `most`, whatever weight it has.
double truncated_total(const Graph& graph, SolverEngine engine, double most) {
  CostByType cost = make_engine(graph, engine)->cost();
  for (const FactorType doubtful :
       {FactorType::kPlaneMoments, FactorType::kSegment, FactorType::kLoop}) {
    cost[static_cast<std::size_t>(doubtful)] = 0;
  }
  double sum = total(cost);
  const RobustWeights chi2 = chi_squared_of(graph);
  for (const auto* kind : {&chi2.plane_moments, &chi2.segments, &chi2.loops}) {
    for (const double one : *kind) sum += std::min(one, most);
  }
  return sum;
}

bool refine_further(Graph& graph, const ExtrinsicsOptions& options) {
  RefineOptions further;
  further.engine = options.engine;
  further.refined_before = true;
  further.thorough = false;
  return is_finite(refine(graph, further));
}

// Sensors that something was seen by.
std::vector<ExtrinsicsId> sensors_with_views(const Graph& graph) {
  std::vector<ExtrinsicsId> all;
  for (const Extrinsics& e : graph.extrinsics) {
    const bool sees =
        std::any_of(graph.plane_moments.begin(), graph.plane_moments.end(), [&e](const auto& view) {
          return view.extrinsics == e.id ||
                 std::any_of(view.by_sensor.begin(), view.by_sensor.end(),
                             [&e](const SensorMoments& part) { return part.extrinsics == e.id; });
        });
    if (sees) all.push_back(e.id);
  }
  return all;
}

// Directions of the information against the prior, and the estimate along those that are observed.
FoundExtrinsics along_observed(const Extrinsics& sensor, const Matrix6d& covariance,
                               const ExtrinsicsOptions& options) {
  FoundExtrinsics result{sensor.id, sensor.sensor, sensor.prior, sensor.prior, covariance};
  const Vector6d& sigma = sensor.prior_sigma;
  const Matrix6d relative = sigma.cwiseInverse().asDiagonal() * covariance *
                            sigma.cwiseInverse().asDiagonal();  // of the prior: identity
  result.told = (1 - relative.diagonal().array()).max(0).matrix();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(relative);
  const Vector6d off = (sensor.prior.inverse() * sensor.state).log().cwiseQuotient(sigma);
  const double most = options.unobserved_share * options.unobserved_share;
  Vector6d kept = Vector6d::Zero();
  for (int k = 0; k < 6; ++k) {
    if (!(eigen.eigenvalues()(k) < most)) continue;
    ++result.observed;
    const Vector6d axis = eigen.eigenvectors().col(k);
    kept += axis.dot(off) * axis;
  }
  result.found = sensor.prior * SE3::exp(kept.cwiseProduct(sigma));
  return result;
}

double farthest(const FoundExtrinsics& found, const Vector6d& sigma) {
  return (found.stated.inverse() * found.found).log().cwiseQuotient(sigma).norm();
}

}  // namespace

std::optional<ExtrinsicsEstimate> estimate_extrinsics(const Graph& graph,
                                                      const ExtrinsicsOptions& options) {
  const std::vector<ExtrinsicsId> sensors = sensors_with_views(graph);
  if (sensors.empty()) return std::nullopt;
  Graph stated = graph, free = graph;
  for (const ExtrinsicsId id : sensors) {
    Extrinsics& e = free.at(id);
    e.estimate = true;
    e.prior_sigma << Eigen::Vector3d::Constant(options.sigma_place_m),
        Eigen::Vector3d::Constant(options.sigma_turn_deg * M_PI / 180);
  }
  if (!refine_further(stated, options) || !refine_further(free, options)) return std::nullopt;
  CovarianceRequest request;
  request.extrinsics = sensors;
  const Covariances known = covariances(free, request);
  if (!known.valid || !known.joint_extrinsics.allFinite()) return std::nullopt;
  ExtrinsicsEstimate result;
  result.covariance = known.joint_extrinsics;
  result.value.resize(known.joint_extrinsics.rows());
  int observed = 0;
  bool contradicts = false;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const Extrinsics& e = free.at(sensors[i]);
    const auto at = static_cast<Eigen::Index>(6 * i);
    result.value.segment<6>(at) = (e.prior.inverse() * e.state).log();
    result.sensors.push_back(
        along_observed(e, known.joint_extrinsics.block<6, 6>(at, at), options));
    observed += result.sensors.back().observed;
    contradicts =
        contradicts || farthest(result.sensors.back(), e.prior_sigma) > options.most_sigmas;
  }
  const double most = RefineOptions().inlier_chi2;
  result.total_stated = truncated_total(stated, options.engine, most);
  result.total_free = truncated_total(free, options.engine, most);
  result.price = observed * std::log(std::max<double>(2, double(graph.plane_moments.size())));
  result.adopted = observed > 0 && !contradicts && result.value.allFinite() &&
                   result.total_free + result.price < result.total_stated;
  return result;
}

}  // namespace lamina
