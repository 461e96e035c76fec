// A solver of a sliding window: Gauss-Newton on the window's own equations, or Ceres.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lamina/backend/solver/engine.hpp>
#include <lamina/backend/solver/window/window_state.hpp>
#include <lamina/backend/solver/window/window_system.hpp>

namespace lamina {

struct WindowOptions {
  SolverEngine engine = SolverEngine::kNative;  ///< also of the mapper's refinements
  /// Keyframes kept as variables. More smooth longer, at a cost that grows linearly.
  int keyframes = 20;
  /// Time kept, s; 0: by number alone. At least three keyframes stay.
  double seconds = 0;
  /// A plane not seen by any keyframe of the window stays a variable for so many keyframes more:
  /// short occlusions must not cost what is known of it.
  int idle_keyframes = 20;
  /// Planes kept as variables at most; the longest unseen leave first. Bounds the time of a step.
  int max_planes = 80;
  /// Planes that left and are still known together with what stays, at most; the longest away are
  /// forgotten first. They cost their number squared at a keyframe, nothing at a step.
  int planes_behind = 80;
  int iterations = 3;  ///< Gauss-Newton steps at most per solve()
  /// Stop when the next step would lower chi-squared by less than this. A tenth of a unit is a
  /// third of a sigma in one direction.
  double stop_chi_squared = 0.02;
  /// Huber's bound on the chi-squared of one plane observation (3 degrees of freedom at 99.9 %).
  double robust_chi_squared = 16.3;
  /// A plane that comes back after it was forgotten is tied to its old estimate with its covariance
  /// times this. Planes that left together share the drift of their time, and return together:
  /// taken as independent they would count as many as they are. Covariance intersection with equal
  /// shares [Julier1997] divides by their number; 50 returning planes are a large room.
  double return_inflation = 50.0;

  /// One line for each setting that cannot be.
  std::vector<std::string> problems() const;
};

struct WindowReport {
  int iterations = 0;
  bool converged = false;   ///< the last step promised less than stop_chi_squared
  double chi_squared = 0;   ///< at the end, robust
  int residuals = 0;        ///< rows, marginal prior included
  int held_directions = 0;  ///< no evidence at all in so many directions: they did not move
  bool finite = true;       ///< false: a number was not finite; the estimate is as before
};

/// Moves a window's states to where its robust cost is least. Adding, marginalising and covariances
/// are the window's: they are the same by either engine.
class WindowEngine {
 public:
  virtual ~WindowEngine() = default;
  /// What it keeps between solves may be left out.
  virtual std::unique_ptr<WindowEngine> clone() const = 0;
  /// `system` has the undamped factor of the equations at the solution afterwards. Where a number
  /// was not finite the states are as before.
  virtual WindowReport solve(window::State& state, const WindowOptions& options,
                             WindowSystem& system) = 0;
};

std::unique_ptr<WindowEngine> make_window_engine(SolverEngine engine);

}  // namespace lamina
