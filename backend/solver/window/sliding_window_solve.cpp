// Gauss-Newton steps of the window.
#include <lamina/backend/solver/window/sliding_window.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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

namespace {

// How long a factor of the equations serves. It is most of a step's cost, and after a short step
// the equations have hardly changed: the gradient is made anew at every step, the factor where it
// has to be.
struct FactorReuse {
  double lambda = 0;
  bool factored = false;         // the factor is one of equations like the present ones
  bool present_weights = false;  // the gradient is that of the robust cost
  double moved = 0, promised_before = std::numeric_limits<double>::infinity();

  bool promises_too_little(double promised) const {
    constexpr double kQuickly = 0.05;  // of what the step before promised
    return factored && promised > kQuickly * promised_before;
  }
  void stepped(double length, double promised) {
    moved += length;
    promised_before = promised;
    present_weights = true;
  }
  bool outworn(double weight_change) const {
    constexpr double kMoved = 0.02;  // length() of the steps a factor serves for
    constexpr double kWeight = 0.1;  // change of a robust weight that it serves for
    return !factored || moved > kMoved || weight_change > kWeight;
  }
};

}  // namespace

WindowReport SlidingWindow::solve() {
  WindowReport report;
  double cost = build(Build::kFirst);
  report.residuals =
      static_cast<int>(prior_.r.size() + 6 * betweens_.size() + 6 * singles_.size() +
                       2 * gravity_.size() + 3 * holds_.size() + 4 * sightings_.size());
  report.chi_squared = cost;
  report.finite = std::isfinite(cost);
  FactorReuse reuse;
  reuse.present_weights = weight_change_ == 0;
  const auto make_anew = [&](double damping) {
    build(Build::kEquations);
    reuse = FactorReuse{damping, false, true};
  };
  while (report.finite && report.iterations < options_.iterations) {
    report.finite = reuse.factored || system_.factor(reuse.lambda);
    if (!report.finite) break;
    const Eigen::VectorXd d = system_.step();
    const double promised = -system_.gradient().dot(d);
    report.finite = d.allFinite() && std::isfinite(promised);
    if (!report.finite) break;
    const bool last = promised < options_.stop_chi_squared && reuse.present_weights;
    if (!last && reuse.promises_too_little(promised)) {
      make_anew(0);
      continue;
    }
    ++report.iterations;
    const bool again = std::exchange(reuse.factored, reuse.lambda == 0);
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
      const bool minimum = report.converged = promised <= 1e-9 * cost;
      make_anew(minimum || again ? 0 : reuse.lambda == 0 ? 1e-4 : 10 * reuse.lambda);
      if (minimum) break;
      continue;
    }
    cost = report.chi_squared = better;
    reuse.stepped(length(d), promised);
    if (reuse.outworn(weight_change_)) make_anew(reuse.lambda < 1e-6 ? 0 : 0.1 * reuse.lambda);
  }
  // Covariances come from the undamped equations.
  if (report.finite && !reuse.factored) report.finite = system_.factor(0);
  report.held_directions = system_.held();
  solved_ = report.finite;
  return report;
}

}  // namespace lamina
