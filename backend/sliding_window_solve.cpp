// Gauss-Newton steps of the window.
#include <lamina/backend/sliding_window.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lamina {

// How far a step moves what Jacobians depend on: rad, and metres as seen in 5 m.
double SlidingWindow::length(const Eigen::VectorXd& d) const {
  double most = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const Vector6d step = d.segment<6>(WindowSystem::pose_column(static_cast<int>(i)));
    most = std::max({most, step.head<3>().norm() / 5, step.tail<3>().norm()});
  }
  return most;
}

// A factor is most of a step's cost, and after a short step the equations have hardly changed: the
// gradient is made anew at every step, the factor where it has to be.
WindowReport SlidingWindow::solve() {
  constexpr double kMoved = 0.02;    // length() of the steps a factor serves for
  constexpr double kWeight = 0.1;    // change of a robust weight that it serves for
  constexpr double kQuickly = 0.05;  // a step with it promises less than this of the one before
  WindowReport report;
  double cost = build(Build::kFirst), lambda = 0;
  report.residuals =
      static_cast<int>(prior_.r.size() + 6 * betweens_.size() + 6 * singles_.size() +
                       2 * gravity_.size() + 3 * holds_.size() + 4 * sightings_.size());
  report.chi_squared = cost;
  report.finite = std::isfinite(cost);
  bool factored = false;  // the factor is one of equations like the present ones
  bool present_weights = weight_change_ == 0;  // the gradient is that of the robust cost
  double moved = 0, promised_before = std::numeric_limits<double>::infinity();
  const auto make_anew = [&](double damping) {
    lambda = damping;
    build(Build::kEquations);
    factored = false;
    present_weights = true;
    moved = 0;
    promised_before = std::numeric_limits<double>::infinity();
  };
  while (report.finite && report.iterations < options_.iterations) {
    if (!factored && !system_.factor(lambda)) {
      report.finite = false;
      break;
    }
    const Eigen::VectorXd d = system_.step();
    const double promised = -system_.gradient().dot(d);
    if (!d.allFinite() || !std::isfinite(promised)) {
      report.finite = false;
      break;
    }
    const bool last = promised < options_.stop_chi_squared && present_weights;
    if (factored && !last && promised > kQuickly * promised_before) {
      make_anew(0);
      continue;
    }
    ++report.iterations;
    const bool undamped = lambda == 0, again = factored;
    factored = undamped;
    const auto poses = poses_;
    const auto planes = planes_;
    apply(d);
    if (last) {
      report.converged = true;
      report.chi_squared = std::max(0.0, cost - promised);
      break;
    }
    const double better = build(Build::kGradient);
    if (!(better < cost) || !std::isfinite(better)) {
      poses_ = poses;
      planes_ = planes;
      // What it promised is below the cost's own rounding: this is the minimum.
      const bool minimum = promised <= 1e-9 * cost;
      make_anew(minimum || again ? 0 : lambda == 0 ? 1e-4 : 10 * lambda);
      report.converged = minimum;
      if (minimum) break;
      continue;
    }
    cost = report.chi_squared = better;
    moved += length(d);
    promised_before = promised;
    present_weights = true;
    if (!undamped || moved > kMoved || weight_change_ > kWeight) {
      make_anew(lambda < 1e-6 ? 0 : 0.1 * lambda);
    }
  }
  // Covariances come from the undamped equations.
  if (report.finite && !factored) report.finite = system_.factor(0);
  report.held_directions = system_.held();
  solved_ = report.finite;
  return report;
}

}  // namespace lamina
