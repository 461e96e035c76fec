// Positions that follow turns, and directions that nothing constrains.
#include <lamina/backend/solver/native/native_engine.hpp>

#include <algorithm>

namespace lamina {

bool NativeEngine::let_positions_follow() {
  equations_.linearize();
  return lamina::let_positions_follow(equations_, 1e-13, false);
}

int NativeEngine::rank_deficiency() {
  // Relative size of a pivot that no damping of a healthy solve can have made: where the last
  // system, which was damped, had none below it, nothing is unconstrained.
  constexpr double kCertainPivot = 1e-8;
  if (dimension() == 0 || equations_.weak_pivots(kCertainPivot) == 0) return 0;
  return lamina::rank_deficiency(equations_);
}

int rank_deficiency(NormalEquations& equations) {
  // Relative size of a pivot below which a direction counts as unconstrained.
  constexpr double kWeakPivot = 1e-11;
  equations.linearize();
  const Eigen::VectorXd diagonal = equations.diagonal();
  for (const double damping : {1e-13, 1e-10, 1e-7}) {
    Eigen::VectorXd added = damping * diagonal;
    for (Eigen::Index i = 0; i < added.size(); ++i) {
      if (!(diagonal(i) > 0)) added(i) = 1e-300;  // no factor at all: its pivot is this
    }
    if (equations.factorize(added)) {
      return equations.weak_pivots(std::max(kWeakPivot, 10 * damping));
    }
  }
  return equations.dimension();
}

}  // namespace lamina
