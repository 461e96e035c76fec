// Which engine solves a window, and what its settings can be.
#include <lamina/backend/solver/window/window_engine.hpp>

#include <lamina/backend/solver/ceres/ceres_window.hpp>
#include <lamina/backend/solver/window/gauss_newton_window.hpp>

namespace lamina {

std::vector<std::string> WindowOptions::problems() const {
  std::vector<std::string> result;
  const auto require = [&result](bool holds, const char* text) {
    if (!holds) result.emplace_back(text);
  };
  require(keyframes >= 3, "window.keyframes: expected at least 3");
  require(seconds >= 0, "window.seconds: expected 0 (no limit) or more");
  require(idle_keyframes >= 0, "window.idle_keyframes: expected 0 or more");
  require(max_planes >= 1, "window.max_planes: expected at least 1");
  require(planes_behind >= 0, "window.planes_behind: expected 0 or more");
  require(iterations >= 1, "window.iterations: expected at least 1");
  require(stop_chi_squared > 0, "window.stop_chi_squared: expected more than 0");
  require(robust_chi_squared > 0, "window.robust_chi_squared: expected more than 0");
  require(return_inflation >= 1, "window.return_inflation: expected 1 or more");
  return result;
}

std::unique_ptr<WindowEngine> make_window_engine(SolverEngine engine) {
  if (engine == SolverEngine::kCeres) return std::make_unique<CeresWindow>();
  return std::make_unique<GaussNewtonWindow>();
}

}  // namespace lamina
