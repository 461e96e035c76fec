// A persistent ceres::Problem that follows a window's states and factors.
#include <lamina/backend/solver/ceres/ceres_window.hpp>

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <lamina/backend/graph/factors/marginal_prior.hpp>
#include <lamina/backend/solver/ceres/lift.hpp>
#include <lamina/backend/solver/ceres/window_cost.hpp>
#include <lamina/backend/solver/window/window_equations.hpp>

namespace lamina {

using window::OnMap;
using window::PlaneBlock;
using window::PoseBlock;
using window::SurfelBlock;
using window::WindowCost;

namespace {

/// |S (plane - at)|^2 in the tangent of `at`.
class PlanePriorCost final : public ceres::SizedCostFunction<3, 4> {
 public:
  PlanePriorCost(const window::PlanePrior& prior, const PlaneBlock& block)
      : at_(prior.at), S_(prior.S), block_(block) {}
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    const PlaneState now = block_.at(x[0]);
    Eigen::Vector3d::Map(residuals) = S_ * now.minus(at_);
    if (jacobians != nullptr && jacobians[0] != nullptr) lift(now, x[0], S_, jacobians[0]);
    return true;
  }

 private:
  PlaneState at_;
  Eigen::Matrix3d S_;
  const PlaneBlock& block_;
};

/// |r + R d|^2 of what left; blocks are the prior's poses, then its planes.
class WindowPriorCost final : public ceres::CostFunction {
 public:
  WindowPriorCost(const window::Prior& prior, std::vector<const PlaneBlock*> planes)
      : prior_(prior), planes_(std::move(planes)) {
    set_num_residuals(static_cast<int>(prior_.r.size()));
    auto& sizes = *mutable_parameter_block_sizes();
    sizes.assign(prior_.poses.size(), PoseState::kAmbient);
    sizes.insert(sizes.end(), prior_.planes.size(), PlaneState::kAmbient);
  }
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    const auto block = [&](std::size_t k) { return jacobians != nullptr ? jacobians[k] : nullptr; };
    Eigen::VectorXd d(prior_.R.cols());
    Eigen::Index column = 0;
    std::size_t k = 0;
    for (std::size_t i = 0; i < prior_.poses.size(); ++i, ++k, column += 6) {
      const PoseState now(x[k]);
      d.segment<6>(column) = marginal_delta(prior_.poses_at[i], now, nullptr);
      if (block(k) != nullptr) lift(now, x[k], prior_.R.middleCols<6>(column), block(k));
    }
    for (std::size_t i = 0; i < prior_.planes.size(); ++i, ++k, column += 3) {
      const PlaneState now = planes_[i]->at(x[k]);
      d.segment<3>(column) = now.minus(prior_.planes_at[i]);
      if (block(k) != nullptr) lift(now, x[k], prior_.R.middleCols<3>(column), block(k));
    }
    Eigen::VectorXd::Map(residuals, prior_.r.size()) = prior_.r + prior_.R * d;
    return true;
  }

 private:
  window::Prior prior_;
  std::vector<const PlaneBlock*> planes_;
};

/// A user's factor, first estimates where its keyframes are frozen.
class WindowCustomCost final : public ceres::CostFunction {
 public:
  WindowCustomCost(const CustomFactor& factor, std::vector<const PoseBlock*> blocks)
      : factor_(factor), blocks_(std::move(blocks)) {
    set_num_residuals(factor_.cost->num_residuals());
    *mutable_parameter_block_sizes() = factor_.cost->parameter_block_sizes();
  }
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    CustomEvaluation e;
    if (!evaluate(factor_, {x, x + blocks_.size()}, false, e)) return false;
    Eigen::VectorXd::Map(residuals, e.r.size()) = e.r;
    if (jacobians == nullptr) return true;
    std::vector<std::array<double, PoseState::kAmbient>> first(blocks_.size());
    std::vector<const double*> at_first;
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      blocks_[k]->linear(PoseState(x[k])).write(first[k].data());
      at_first.push_back(first[k].data());
    }
    if (!evaluate(factor_, at_first, true, e)) return false;
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      if (jacobians[k] == nullptr) continue;
      const PoseState now(x[k]);
      const Eigen::Matrix<double, Eigen::Dynamic, 6> J = to_tangent(now, at_first[k], e.J[k]);
      lift(now, x[k], J, jacobians[k]);
    }
    return true;
  }

 private:
  CustomFactor factor_;
  std::vector<const PoseBlock*> blocks_;
};

/// Ends a solve as the own engine does: when a step promises too little.
class StopOnPromise final : public ceres::IterationCallback {
 public:
  explicit StopOnPromise(double chi_squared) : chi_squared_(chi_squared) {}
  bool converged = false;
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& s) override {
    if (s.iteration == 0 || s.relative_decrease == 0) return ceres::SOLVER_CONTINUE;
    converged = std::abs(2 * s.cost_change / s.relative_decrease) < chi_squared_;
    return converged ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  double chi_squared_;
};

ceres::Problem::Options problem_options() {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.enable_fast_removal = true;
  return options;
}

}  // namespace

struct CeresWindow::Impl {
  StateManifolds manifolds;
  std::unique_ptr<ceres::LossFunction> huber;
  std::vector<std::unique_ptr<ceres::LossFunction>> scaled;  // of factors of a weight
  std::map<KeyframeId, PoseBlock> poses;
  std::map<PlaneId, PlaneBlock> planes;
  std::map<SurfelId, SurfelBlock> surfels;
  ceres::CauchyLoss parent_loss{kSurfelParentScale};
  std::map<std::uint64_t, ceres::ResidualBlockId> residuals;  // by the factors' serials
  ceres::Problem problem{problem_options()};

  void follow(const window::State& state, const WindowOptions& options);
  void remove_what_left(const window::State& state);
  void take_states(const window::State& state);
  void add_what_is_new(const window::State& state);
  void add_new_surfels(const window::State& state);
  template <class Make>
  void add_new(std::uint64_t serial, const Make& make) {
    const auto [known, fresh] = residuals.try_emplace(serial, nullptr);
    if (fresh) known->second = make();
  }
  ceres::ResidualBlockId add_prior(const window::Prior& prior);
  ceres::ResidualBlockId add_custom(const window::Custom& custom);
  void write(window::State& state) const;
};

void CeresWindow::Impl::follow(const window::State& state, const WindowOptions& options) {
  if (!huber) huber = std::make_unique<ceres::HuberLoss>(std::sqrt(options.robust_chi_squared));
  remove_what_left(state);
  take_states(state);
  add_what_is_new(state);
}

void CeresWindow::Impl::remove_what_left(const window::State& state) {
  std::set<std::uint64_t> present;
  const auto collect = [&present](const auto& factors) {
    for (const auto& factor : factors) present.insert(factor.serial);
  };
  collect(state.relative_poses);
  collect(state.pose_priors);
  collect(state.gravity);
  collect(state.plane_priors);
  collect(state.views);
  collect(state.surfels);
  for (const window::Surfel& surfel : state.surfels) collect(surfel.views);
  collect(state.custom);
  if (state.prior.r.size() > 0) present.insert(state.prior.serial);
  std::erase_if(residuals, [&](const auto& residual) {
    if (present.count(residual.first) > 0) return false;
    problem.RemoveResidualBlock(residual.second);
    return true;
  });
  const auto gone = [&](auto& block) {
    if (state.find(block.first) >= 0) return false;
    problem.RemoveParameterBlock(block.second.x.data());
    return true;
  };
  std::erase_if(poses, gone);
  std::erase_if(planes, gone);
  std::erase_if(surfels, gone);
}

void CeresWindow::Impl::take_states(const window::State& state) {
  const auto take = [this](auto& blocks, const auto& one, ceres::Manifold& manifold) {
    const auto [block, fresh] = blocks.try_emplace(one.id);
    auto& x = block->second.x;
    if (fresh) problem.AddParameterBlock(x.data(), static_cast<int>(x.size()), &manifold);
    block->second.take(one);
  };
  for (const window::Pose& pose : state.poses) take(poses, pose, manifolds.pose);
  for (const window::Landmark& plane : state.planes) take(planes, plane, manifolds.plane);
  for (const window::Surfel& surfel : state.surfels) {
    const auto [block, fresh] = surfels.try_emplace(surfel.id);
    if (fresh) problem.AddParameterBlock(block->second.x.data(), FlatState::kAmbient);
    surfel.now.write(block->second.x.data());
  }
}

void CeresWindow::Impl::add_new_surfels(const window::State& state) {
  for (const window::Surfel& surfel : state.surfels) {
    SurfelBlock& block = surfels.at(surfel.id);
    for (const window::SurfelView& view : surfel.views) {
      add_new(view.serial, [&] {
        using Seen = OnMap<SurfelMomentsTerm, PoseState>;
        PoseBlock& pose = poses.at(view.keyframe);
        return problem.AddResidualBlock(
            new WindowCost<Seen, PoseBlock, SurfelBlock>(Seen{view.term}, pose, block), nullptr,
            pose.x.data(), block.x.data());
      });
    }
    add_new(surfel.serial, [&] {
      using Tie = OnMap<SurfelParentTerm, PlaneState>;
      PlaneBlock& plane = planes.at(surfel.parent);
      return problem.AddResidualBlock(
          new WindowCost<Tie, PlaneBlock, SurfelBlock>(Tie{surfel.tie}, plane, block), &parent_loss,
          plane.x.data(), block.x.data());
    });
  }
}

void CeresWindow::Impl::add_what_is_new(const window::State& state) {
  const auto add = [this](auto* cost, ceres::LossFunction* loss, auto&... blocks) {
    return problem.AddResidualBlock(cost, loss, blocks.x.data()...);
  };
  for (const auto& f : state.relative_poses) {
    add_new(f.serial, [&] {
      PoseBlock &a = poses.at(f.from), &b = poses.at(f.to);
      return add(new WindowCost<OdometryTerm, PoseBlock, PoseBlock>(f.term, a, b),
                 f.robust ? huber.get() : nullptr, a, b);
    });
  }
  const auto add_of_pose = [&](const auto& f) {
    using Term = std::decay_t<decltype(f.term)>;
    add_new(f.serial, [&] {
      PoseBlock& a = poses.at(f.id);
      return add(new WindowCost<Term, PoseBlock>(f.term, a), nullptr, a);
    });
  };
  for (const auto& f : state.pose_priors) add_of_pose(f);
  for (const auto& f : state.gravity) add_of_pose(f);
  for (const auto& f : state.plane_priors) {
    add_new(f.serial, [&] {
      PlaneBlock& b = planes.at(f.id);
      return add(new PlanePriorCost(f, b), nullptr, b);
    });
  }
  for (const auto& f : state.views) {
    add_new(f.serial, [&] {
      PoseBlock& a = poses.at(f.keyframe);
      PlaneBlock& b = planes.at(f.plane);
      return add(new WindowCost<PlaneMomentsTerm, PoseBlock, PlaneBlock>(f.term, a, b), huber.get(),
                 a, b);
    });
  }
  add_new_surfels(state);
  for (const auto& f : state.custom) add_new(f.serial, [&] { return add_custom(f); });
  if (state.prior.r.size() > 0) {
    add_new(state.prior.serial, [&] { return add_prior(state.prior); });
  }
}

ceres::ResidualBlockId CeresWindow::Impl::add_prior(const window::Prior& prior) {
  std::vector<double*> blocks;
  std::vector<const PlaneBlock*> of_planes;
  for (const KeyframeId id : prior.poses) blocks.push_back(poses.at(id).x.data());
  for (const PlaneId id : prior.planes) {
    of_planes.push_back(&planes.at(id));
    blocks.push_back(planes.at(id).x.data());
  }
  return problem.AddResidualBlock(new WindowPriorCost(prior, of_planes), nullptr, blocks);
}

ceres::ResidualBlockId CeresWindow::Impl::add_custom(const window::Custom& custom) {
  std::vector<double*> blocks;
  std::vector<const PoseBlock*> of_poses;
  for (const KeyframeId id : custom.keyframes) {
    of_poses.push_back(&poses.at(id));
    blocks.push_back(poses.at(id).x.data());
  }
  ceres::LossFunction* loss = custom.factor.loss.get();
  if (custom.factor.weight != 1) {
    scaled.push_back(std::make_unique<ceres::ScaledLoss>(loss, custom.factor.weight,
                                                         ceres::DO_NOT_TAKE_OWNERSHIP));
    loss = scaled.back().get();
  }
  return problem.AddResidualBlock(new WindowCustomCost(custom.factor, of_poses), loss, blocks);
}

void CeresWindow::Impl::write(window::State& state) const {
  for (window::Pose& pose : state.poses) pose.now = PoseState(poses.at(pose.id).x.data());
  for (window::Landmark& plane : state.planes) {
    const PlaneBlock& block = planes.at(plane.id);
    plane.now = block.at(block.x.data());
  }
  for (window::Surfel& surfel : state.surfels)
    surfel.now = FlatState(surfels.at(surfel.id).x.data());
}

CeresWindow::CeresWindow() : impl_(std::make_unique<Impl>()) {}
CeresWindow::~CeresWindow() = default;

WindowReport CeresWindow::solve(window::State& state, const WindowOptions& options,
                                WindowSystem& system) {
  impl_->follow(state, options);
  WindowReport report;
  report.residuals = state.residuals();
  ceres::Solver::Options o;
  o.num_threads = 1;
  o.logging_type = ceres::SILENT;
  o.max_num_iterations = 4 * options.iterations;  // loss and damping make smaller steps
  o.initial_trust_region_radius = 1e8;
  o.function_tolerance = o.gradient_tolerance = o.parameter_tolerance = 0;
  o.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  o.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  StopOnPromise stop(options.stop_chi_squared);
  o.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(o, &impl_->problem, &summary);
  report.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  report.converged = stop.converged || summary.termination_type == ceres::CONVERGENCE;
  report.chi_squared = 2 * summary.final_cost;
  report.finite = summary.IsSolutionUsable() && std::isfinite(summary.final_cost);
  if (report.finite) impl_->write(state);
  build_equations(state, options.robust_chi_squared, window::Build::kEquations, system);
  report.finite = system.factor(0) && report.finite;
  report.held_directions = system.held();
  return report;
}

}  // namespace lamina
