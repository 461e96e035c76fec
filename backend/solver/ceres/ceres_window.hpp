// A window by Ceres: one problem that is kept from solve to solve.
#pragma once

#include <memory>

#include <lamina/backend/solver/window/window_engine.hpp>

namespace lamina {

/// Before each solve the problem follows the window: what left is removed, what is new is added
/// (by the factors' serials), everything else stays. Where the marginal prior has a state, costs
/// give the Jacobians of where it was frozen (first estimates); the prior is a cost itself. Plane
/// views carry Huber's loss.
class CeresWindow final : public WindowEngine {
 public:
  CeresWindow();
  ~CeresWindow() override;
  /// The copy begins with an empty problem.
  std::unique_ptr<WindowEngine> clone() const override { return std::make_unique<CeresWindow>(); }
  WindowReport solve(window::State& state, const WindowOptions& options,
                     WindowSystem& system) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lamina
