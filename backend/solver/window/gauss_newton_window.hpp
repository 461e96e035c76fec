// The own engine of a window: Gauss-Newton on normal equations of the window's own shape
// (window_system.hpp). A window is small and solved at every keyframe, where building a general
// problem costs more than solving it.
#pragma once

#include <lamina/backend/solver/window/window_engine.hpp>

namespace lamina {

class GaussNewtonWindow final : public WindowEngine {
 public:
  std::unique_ptr<WindowEngine> clone() const override {
    return std::make_unique<GaussNewtonWindow>();
  }
  WindowReport solve(window::State& state, const WindowOptions& options,
                     WindowSystem& system) override;
};

}  // namespace lamina
