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

// Of factors that may be wrong each no more than `most`, whatever weight it has.
double truncated_total(const Graph& graph, SolverEngine engine, double most) {
  CostByType cost = make_engine(graph, engine)->cost();
  for (const FactorType may_be_wrong :
       {FactorType::kPlaneMoments, FactorType::kSegment, FactorType::kLoop}) {
    cost[static_cast<std::size_t>(may_be_wrong)] = 0;
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

// Directions of the information of all sensors against their priors: what relates two of them may
// be observed where neither is to the body. The estimate along those that are.
class Observed {
 public:
  Observed(const Graph& free, const std::vector<ExtrinsicsId>& sensors,
           const Eigen::MatrixXd& covariance, double share)
      : sigma_(covariance.rows()), off_(covariance.rows()) {
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      const Extrinsics& e = free.at(sensors[i]);
      sigma_.segment<6>(row(i)) = e.prior_sigma;
      off_.segment<6>(row(i)) = (e.prior.inverse() * e.state).log();
    }
    const Eigen::VectorXd weight = sigma_.cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
        weight.asDiagonal() * covariance * weight.asDiagonal());  // of the prior: identity
    count_ = static_cast<int>((eigen.eigenvalues().array() < share * share).count());
    const Eigen::MatrixXd axes = eigen.eigenvectors().leftCols(count_);
    along_ = axes * axes.transpose();
  }
  int directions() const { return count_; }
  const Eigen::VectorXd& estimate() const { return off_; }
  FoundExtrinsics of(const Extrinsics& sensor, std::size_t i, const Matrix6d& covariance) const {
    FoundExtrinsics result{sensor.id, sensor.sensor, sensor.prior, sensor.prior, covariance};
    const Vector6d kept = along_.middleRows<6>(row(i)) * off_.cwiseQuotient(sigma_);
    result.found = sensor.prior * SE3::exp(kept.cwiseProduct(sensor.prior_sigma));
    const Matrix6d own = along_.block<6, 6>(row(i), row(i));
    Matrix6d to_body = Matrix6d::Zero();
    to_body.topLeftCorner<3, 3>() = to_body.bottomRightCorner<3, 3>() = sensor.prior.so3().matrix();
    result.observed_share = (to_body * own * to_body.transpose()).diagonal();
    result.observed = static_cast<int>(std::lround(own.trace()));
    return result;
  }
  static Eigen::Index row(std::size_t i) { return static_cast<Eigen::Index>(6 * i); }

 private:
  Eigen::VectorXd sigma_, off_;
  int count_ = 0;
  Eigen::MatrixXd along_;  // onto observed directions, in prior sigmas
};

double farthest(const FoundExtrinsics& found, const Vector6d& sigma) {
  return (found.stated.inverse() * found.found).log().cwiseQuotient(sigma).norm();
}

// The graph with the states of these sensors free.
Graph freed(Graph graph, const std::vector<ExtrinsicsId>& sensors,
            const ExtrinsicsOptions& options) {
  for (const ExtrinsicsId id : sensors) {
    Extrinsics& e = graph.at(id);
    e.estimate = true;
    e.prior_sigma << Eigen::Vector3d::Constant(options.sigma_place_m),
        Eigen::Vector3d::Constant(options.sigma_turn_deg * M_PI / 180);
  }
  return graph;
}

}  // namespace

std::optional<ExtrinsicsEstimate> estimate_extrinsics(const Graph& graph,
                                                      const ExtrinsicsOptions& options) {
  const std::vector<ExtrinsicsId> sensors = sensors_with_views(graph);
  if (sensors.empty()) return std::nullopt;
  Graph stated = graph, free = freed(graph, sensors, options);
  if (!refine_further(stated, options) || !refine_further(free, options)) return std::nullopt;
  CovarianceRequest request;
  request.extrinsics = sensors;
  const Covariances known = covariances(free, request);
  if (!known.valid || !known.joint_extrinsics.allFinite()) return std::nullopt;
  const Observed observed(free, sensors, known.joint_extrinsics, options.unobserved_share);
  ExtrinsicsEstimate result;
  result.value = observed.estimate();
  result.covariance = known.joint_extrinsics;
  bool contradicts = false;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const Extrinsics& e = free.at(sensors[i]);
    const Eigen::Index at = Observed::row(i);
    result.sensors.push_back(observed.of(e, i, known.joint_extrinsics.block<6, 6>(at, at)));
    contradicts =
        contradicts || farthest(result.sensors.back(), e.prior_sigma) > options.most_sigmas;
  }
  const double most = RefineOptions().inlier_chi2;
  result.total_stated = truncated_total(stated, options.engine, most);
  result.total_free = truncated_total(free, options.engine, most);
  result.price =
      observed.directions() * std::log(std::max<double>(2, double(graph.plane_moments.size())));
  result.adopted = observed.directions() > 0 && !contradicts && result.value.allFinite() &&
                   result.total_free + result.price < result.total_stated;
  return result;
}

}  // namespace lamina
