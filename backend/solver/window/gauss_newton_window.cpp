// Gauss-Newton steps of a window.
#include <lamina/backend/solver/window/gauss_newton_window.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <lamina/backend/solver/window/window_equations.hpp>

namespace lamina {

using window::Build;

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

// How far a step moves what Jacobians depend on: rad, and metres as seen in 5 m.
double length_of(const Eigen::VectorXd& d, std::size_t poses) {
  double most = 0;
  for (std::size_t i = 0; i < poses; ++i) {
    const Vector6d step = d.segment<6>(WindowSystem::pose_column(static_cast<int>(i)));
    most = std::max({most, step.head<3>().norm() / 5, step.tail<3>().norm()});
  }
  return most;
}

void apply(const Eigen::VectorXd& d, const WindowSystem& system, window::State& state) {
  for (std::size_t i = 0; i < state.poses.size(); ++i) {
    const Vector6d step = d.segment<6>(WindowSystem::pose_column(static_cast<int>(i)));
    state.poses[i].now = state.poses[i].now.plus(step);
  }
  for (std::size_t i = 0; i < state.planes.size(); ++i) {
    const Eigen::Vector3d step = d.segment<3>(system.plane_column(static_cast<int>(i)));
    state.planes[i].now = state.planes[i].now.carried(step);
  }
}

}  // namespace

WindowReport GaussNewtonWindow::solve(window::State& state, const WindowOptions& options,
                                      WindowSystem& system) {
  WindowReport report;
  const auto build = [&](Build what) {
    return build_equations(state, options.robust_chi_squared, what, system);
  };
  window::BuiltEquations built = build(Build::kFirst);
  double cost = built.cost;
  report.residuals = state.residuals();
  report.chi_squared = cost;
  report.finite = std::isfinite(cost);
  FactorReuse reuse;
  reuse.present_weights = built.weight_change == 0;
  const auto make_anew = [&](double damping) {
    built = build(Build::kEquations);
    reuse = FactorReuse{damping, false, true};
  };
  while (report.finite && report.iterations < options.iterations) {
    report.finite = reuse.factored || system.factor(reuse.lambda);
    if (!report.finite) break;
    const Eigen::VectorXd d = system.step();
    const double promised = -system.gradient().dot(d);
    report.finite = d.allFinite() && std::isfinite(promised);
    if (!report.finite) break;
    const bool last = promised < options.stop_chi_squared && reuse.present_weights;
    if (!last && reuse.promises_too_little(promised)) {
      make_anew(0);
      continue;
    }
    ++report.iterations;
    const bool again = std::exchange(reuse.factored, reuse.lambda == 0);
    const auto poses = state.poses;
    const auto planes = state.planes;
    apply(d, system, state);
    if (last) {
      report.converged = true;
      report.chi_squared = std::max(0.0, cost - promised);
      break;
    }
    built = build(Build::kGradient);
    const double better = built.cost;
    if (!(better < cost) || !std::isfinite(better)) {
      state.poses = poses;
      state.planes = planes;
      // What it promised is below the cost's own rounding: this is the minimum.
      const bool minimum = report.converged = promised <= 1e-9 * cost;
      make_anew(minimum || again ? 0 : reuse.lambda == 0 ? 1e-4 : 10 * reuse.lambda);
      if (minimum) break;
      continue;
    }
    cost = report.chi_squared = better;
    reuse.stepped(length_of(d, state.poses.size()), promised);
    if (reuse.outworn(built.weight_change)) make_anew(reuse.lambda < 1e-6 ? 0 : 0.1 * reuse.lambda);
  }
  // Covariances come from the undamped equations.
  if (report.finite && !reuse.factored) report.finite = system.factor(0);
  report.held_directions = system.held();
  return report;
}

}  // namespace lamina
