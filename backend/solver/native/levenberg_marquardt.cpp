// Levenberg-Marquardt with the step's predicted decrease as stopping rule.
#include <lamina/backend/solver/native/levenberg_marquardt.hpp>

#include <cmath>

namespace lamina {

namespace {

/// Diagonal that damping is relative to: never zero, so that a state without factors stays put.
Eigen::VectorXd damping_scale(const NormalEquations& equations) {
  Eigen::VectorXd scale = equations.diagonal();
  const double least = 1e-12 * std::max(scale.size() > 0 ? scale.maxCoeff() : 0.0, 1e-6);
  return scale.cwiseMax(least);
}

/// One damped system; empty when it cannot be factored or solved.
Eigen::VectorXd damped_step(NormalEquations& equations, const Eigen::VectorXd& scale,
                            double damping) {
  if (!equations.factorize(damping * scale)) return {};
  Eigen::VectorXd step = equations.solve(-equations.gradient());
  if (!step.allFinite()) return {};
  return step;
}

/// A step that lowers the cost by less than this share of what it promised: let positions follow.
constexpr double kPoorRatio = 0.75;

}  // namespace

bool let_positions_follow(NormalEquations& equations, double damping, bool further) {
  constexpr double kHold = 1e12;
  const Eigen::VectorXd scale = damping_scale(equations), turns = equations.turning();
  if (!equations.factorize(damping * scale + kHold * turns.cwiseProduct(scale))) return false;
  const Eigen::VectorXd step =
      equations.solve(-equations.gradient()).cwiseProduct((1 - turns.array()).matrix());
  if (!step.allFinite()) return false;
  equations.step(step, further);
  return true;
}

namespace {

/// The better the quadratic model told the decrease, the less damping [Nielsen1999].
class Damping {
 public:
  explicit Damping(const MinimizerOptions& options)
      : options_(options), value_(options.initial_damping) {}
  double value() const { return value_; }
  /// `ratio`: of the decrease to the predicted one.
  void accept(double ratio) {
    // Where no step was refused so far, it may go at once.
    const double least = rejections_ > 0 ? 1.0 / 3 : 0.1;
    const double trust = 2 * std::min(1.0, ratio) - 1;
    const double change = std::max(least, 1 - trust * trust * trust);
    value_ = change < 1 ? std::max(options_.initial_damping, change * value_)
                        : std::max(1e-10, 2 * change * value_);
    growth_ = 10;
  }
  /// False: there is no use in trying on.
  bool reject() {
    value_ = std::max(1e-9, value_) * growth_;
    growth_ *= 2;
    return !(value_ > options_.max_damping || ++rejections_ >= options_.max_rejections);
  }

 private:
  const MinimizerOptions& options_;
  double value_, growth_ = 10;
  int rejections_ = 0;
};

/// The states, their cost and what a step is damped by.
struct DampedDescent {
  NormalEquations& equations;
  const MinimizerOptions& options;
  CostByType cost;
  Eigen::VectorXd scale;
  Damping damping;

  /// Takes a step, or undoes it where it does not lower the cost. `follow`: positions may follow
  /// its turns. True: it promised so little that it was the last.
  bool take(const Eigen::VectorXd& step, bool follow, Iteration& report);
};

bool DampedDescent::take(const Eigen::VectorXd& step, bool follow, Iteration& report) {
  // Of the quadratic model: cost falls by -g.d + damping d^T D d.
  report.predicted_decrease =
      -equations.gradient().dot(step) + damping.value() * step.cwiseAbs2().dot(scale);
  equations.step(step);
  const bool last = report.predicted_decrease <
                    std::max(options.chi2_tolerance, options.relative_tolerance * report.cost);
  CostByType next = last ? equations.cost() : equations.linearize();
  if (follow && !last && !(total(next) < report.cost - kPoorRatio * report.predicted_decrease) &&
      let_positions_follow(equations, damping.value(), true)) {
    next = equations.linearize();
  }
  report.accepted = total(next) < report.cost;
  if (report.accepted) {
    report.cost = total(next);
    cost = next;
  } else {
    equations.undo_step();
    if (!last) equations.linearize();
  }
  return last;
}

}  // namespace

MinimizerResult minimize(NormalEquations& equations, const MinimizerOptions& options,
                         const IterationCallback& progress, const LongPath& path) {
  MinimizerResult result;
  DampedDescent descent{equations, options, equations.linearize(), {}, Damping(options)};
  result.initial_cost = result.final_cost = descent.cost;
  if (equations.dimension() == 0) return result;
  if (!std::isfinite(total(descent.cost))) {
    result.status = SolveStatus::kInvalidInput;
    return result;
  }
  descent.scale = damping_scale(equations);
  int steps = 0;
  result.status = SolveStatus::kMaxIterations;
  while (result.status == SolveStatus::kMaxIterations &&
         result.iterations < options.max_iterations) {
    ++result.iterations;
    const double before = total(descent.cost), damping = descent.damping.value();
    Iteration report{result.iterations, before, 0, damping, false, 0};
    const Eigen::VectorXd step = damped_step(equations, descent.scale, damping);
    if (step.size() > 0) {
      report.largest_turn = equations.largest_turn(step);
      if (result.iterations == 1 && report.largest_turn > path.largest_first_turn) {
        result.turns_too_far = true;
        return result;
      }
      const bool follow = report.largest_turn > path.follow_from_turn;
      if (descent.take(step, follow, report)) result.status = SolveStatus::kConverged;
    }
    const bool go_on = !progress || progress(report);
    if (result.status == SolveStatus::kConverged) break;
    if (!go_on) {
      result.status = SolveStatus::kCancelled;
    } else if (report.accepted) {
      if (++steps >= options.max_steps) break;
      descent.scale = damping_scale(equations);
      descent.damping.accept((before - total(descent.cost)) / report.predicted_decrease);
    } else if (!descent.damping.reject()) {
      result.status = SolveStatus::kStalled;
    }
  }
  result.final_cost = descent.cost;
  return result;
}

}  // namespace lamina
