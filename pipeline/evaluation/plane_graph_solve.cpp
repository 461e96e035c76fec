// Benchmark problems as graphs, and how well they were solved.
#include <lamina/pipeline/evaluation/plane_graph_solve.hpp>

#include <chrono>
#include <cmath>

#include <lamina/models/linalg.hpp>

namespace lamina {
namespace {

/// Moments of weight 1/sigma^2 whose chi-squared is zero at their own best plane: on unit normals
/// n^T (S - l0 I) n = n^T S n - l0 with l0 the least eigenvalue, so nothing but the constant goes.
Moments without_constant(const Moments& unit_weights, double sigma) {
  const Moments m = unit_weights.scaled(1.0 / (sigma * sigma));
  const SymmetricEigen<3> eigen = symmetric_eigen(m.scatter());
  const Eigen::Vector3d kept = (eigen.values.array() - eigen.values(0)).cwiseMax(0.0);
  return Moments(m.weight(), m.mean(),
                 eigen.vectors * kept.asDiagonal() * eigen.vectors.transpose(), m.count());
}

void add_planes(const PlaneGraph& problem, Graph& graph) {
  std::vector<bool> started(static_cast<std::size_t>(problem.plane_count), false);
  for (int j = 0; j < problem.plane_count; ++j) graph.add_plane(PlaneLandmark());
  for (const auto& o : problem.observations) {
    const auto j = static_cast<std::size_t>(o.plane);
    PlaneLandmark& plane = graph.planes[j];
    ++plane.observations;
    if (started[j]) continue;
    const SE3& T = problem.initial_map_body[static_cast<std::size_t>(o.pose)];
    const auto fit = o.moments_body.fit_plane(Eigen::Vector3d::Zero());
    if (!fit) continue;
    const PlaneLandmark fresh = PlaneLandmark::at(T * fit->plane, T * o.moments_body.mean());
    plane.anchor_map = fresh.anchor_map;
    plane.plane_anchor = fresh.plane_anchor;
    plane.T_map_outline = fresh.T_map_outline;
    started[j] = true;
  }
  for (PlaneLandmark& plane : graph.planes) plane.active = plane.observations > 0;
}

}  // namespace

Graph make_graph(const PlaneGraph& problem) {
  Graph graph;
  graph.keyframes.reserve(problem.initial_map_body.size());
  for (std::size_t i = 0; i < problem.initial_map_body.size(); ++i) {
    graph.add_keyframe(Timestamp::from_seconds(static_cast<double>(i)),
                       problem.initial_map_body[i]);
  }
  graph.keyframes.front().fixed = true;
  Vector6d information;
  information.head<3>().setConstant(1.0 / problem.sigma_translation);
  information.tail<3>().setConstant(1.0 / problem.sigma_rotation);
  graph.odometry.reserve(problem.odometry.size());
  for (const auto& step : problem.odometry) {
    graph.odometry.push_back(
        {KeyframeId(step.from), KeyframeId(step.to), step.T_from_to, information.asDiagonal()});
  }
  add_planes(problem, graph);
  graph.plane_moments.reserve(problem.observations.size());
  for (const auto& o : problem.observations) {
    PlaneMomentsFactor factor;
    factor.keyframe = KeyframeId(o.pose);
    factor.plane = PlaneId(o.plane);
    factor.moments_body = without_constant(o.moments_body, problem.sigma_point);
    graph.plane_moments.push_back(factor);
  }
  return graph;
}

PlaneGraphResult solve_plane_graph(const PlaneGraph& problem, const RefineOptions& options,
                                   const std::function<bool(const RefineProgress&)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  PlaneGraphResult result;
  result.graph = make_graph(problem);
  result.refine = refine(result.graph, options, progress);
  result.refine.solve_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.ate_m = position_rmse(result.graph, problem.truth_map_body);
  result.plane_angle_deg = mean_plane_angle_deg(result.graph, problem.truth_planes);
  return result;
}

double position_rmse(const Graph& graph, const std::vector<SE3>& truth) {
  if (truth.empty() || truth.size() != graph.keyframes.size()) return -1;
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    sum += (graph.keyframes[i].T_map_body.translation() - truth[i].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

double mean_plane_angle_deg(const Graph& graph, const std::vector<Plane>& truth) {
  double sum = 0;
  int count = 0;
  for (std::size_t j = 0; j < std::min(truth.size(), graph.planes.size()); ++j) {
    if (!graph.planes[j].active) continue;
    const Plane& estimate = graph.planes[j].plane_anchor;
    sum += angle_between(estimate, truth[j]);
    ++count;
  }
  return count > 0 ? sum / count * 180 / M_PI : -1;
}

}  // namespace lamina
