// Gauss-Newton steps of the window.
#include <lamina/backend/sliding_window.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {

// One more step with the factor at hand, where that ends it: the equations have hardly changed over
// the step `d` that led here, and a factor is most of a step's cost.
bool SlidingWindow::finish_with_same_factor(const Eigen::VectorXd& d, double& promised) {
  constexpr double kStep = 0.02;  // rad, and in 5 m: Jacobians change by as much
  double most = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const Vector6d step = d.segment<6>(WindowSystem::pose_column(static_cast<int>(i)));
    most = std::max({most, step.head<3>().norm() / 5, step.tail<3>().norm()});
  }
  if (most > kStep) return false;
  build(Build::kGradient);
  const Eigen::VectorXd last = system_.step();
  promised = -system_.gradient().dot(last);
  if (!last.allFinite() || !(promised < options_.stop_chi_squared)) return false;
  apply(last);
  return true;
}

WindowReport SlidingWindow::solve() {
  WindowReport report;
  // Before the first step a new keyframe is where odometry put it, and good sightings look like
  // outliers: their weights count from the second step on, or each step would undo a part only.
  bool reweighted = false;
  double cost = build(Build::kEquations, reweighted), lambda = 0;
  report.residuals =
      static_cast<int>(prior_.r.size() + 6 * betweens_.size() + 6 * singles_.size() +
                       2 * gravity_.size() + 3 * holds_.size() + 4 * sightings_.size());
  report.chi_squared = cost;
  report.finite = std::isfinite(cost);
  bool undamped = true;
  while (report.finite && report.iterations < options_.iterations) {
    ++report.iterations;
    undamped = lambda == 0;
    if (!system_.factor(lambda)) {
      report.finite = false;
      break;
    }
    const Eigen::VectorXd d = system_.step();
    double promised = -system_.gradient().dot(d);
    if (!d.allFinite() || !std::isfinite(promised)) {
      report.finite = false;
      break;
    }
    const auto poses = poses_;
    const auto planes = planes_;
    apply(d);
    if (promised < options_.stop_chi_squared) {
      report.converged = true;
      report.chi_squared = std::max(0.0, cost - promised);
      break;
    }
    const double better = build(Build::kCost);
    if (!(better < cost) || !std::isfinite(better)) {
      poses_ = poses;
      planes_ = planes;
      // What it promised is below the cost's own rounding: this is the minimum.
      if (promised <= 1e-9 * cost) {
        report.converged = true;
        undamped = false;
        build(Build::kEquations);
        break;
      }
      lambda = lambda == 0 ? 1e-4 : 10 * lambda;
      build(Build::kEquations);
      reweighted = true;
      continue;
    }
    cost = report.chi_squared = better;
    const bool same_weights = reweighted || least_weight_ >= 1;
    if (undamped && same_weights && report.iterations < options_.iterations &&
        finish_with_same_factor(d, promised)) {
      ++report.iterations;
      report.converged = true;
      report.chi_squared = std::max(0.0, cost - promised);
      break;
    }
    lambda = lambda < 1e-6 ? 0 : 0.1 * lambda;
    build(Build::kEquations);
    reweighted = true;
  }
  // Covariances come from the undamped equations.
  if (report.finite && (!report.converged || !undamped)) report.finite = system_.factor(0);
  report.held_directions = system_.held();
  solved_ = report.finite;
  return report;
}

}  // namespace lamina
