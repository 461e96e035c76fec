// The checks every factor has to pass.
#include <lamina/testing/factor_tester.hpp>

#include <ceres/cost_function.h>
#include <ceres/gradient_checker.h>
#include <ceres/manifold.h>

#include <cmath>
#include <limits>
#include <sstream>

#include <lamina/testing/report_impl.hpp>

namespace lamina {

using detail::failure;

namespace {

using Blocks = FactorTester::Blocks;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const Eigen::IOFormat kRow(10, 0, ", ", "; ", "", "", "[", "]");

std::string text_of(const Blocks& at) {
  std::ostringstream out;
  out.precision(17);
  for (const auto& block : at) {
    out << "{";
    for (std::size_t i = 0; i < block.size(); ++i) out << (i ? ", " : "") << block[i];
    out << "} ";
  }
  return out.str();
}

std::vector<const double*> pointers_to(const Blocks& at) {
  std::vector<const double*> pointers;
  for (const auto& block : at) pointers.push_back(block.data());
  return pointers;
}

// To rounding: automatic derivatives may round otherwise than plain numbers do. False for NaN.
bool same_numbers(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols() || a.size() == 0) return a.size() == b.size();
  const double scale = std::max(1.0, a.cwiseAbs().maxCoeff());
  return a.allFinite() && b.allFinite() &&
         (a - b).cwiseAbs().maxCoeff() <= 8 * std::numeric_limits<double>::epsilon() * scale;
}

// Largest entry of each row over all blocks: what differences in that row are measured by.
Eigen::VectorXd row_scales(const std::vector<Eigen::MatrixXd>& jacobians, Eigen::Index rows) {
  Eigen::VectorXd scales = Eigen::VectorXd::Zero(rows);
  for (const auto& J : jacobians) {
    if (J.cols() > 0) scales = scales.cwiseMax(J.cwiseAbs().rowwise().maxCoeff());
  }
  return scales;
}

FactorReport compare_jacobians(const std::vector<Eigen::MatrixXd>& ours,
                               const std::vector<Eigen::MatrixXd>& theirs, double relative,
                               const char* other, const Blocks& at) {
  const Eigen::Index rows = ours.empty() ? 0 : ours[0].rows();
  const Eigen::VectorXd scales = row_scales(theirs, rows).cwiseMax(row_scales(ours, rows));
  for (std::size_t block = 0; block < ours.size(); ++block) {
    for (Eigen::Index row = 0; row < rows; ++row) {
      const double worst =
          ours[block].cols() == 0
              ? 0
              : (ours[block].row(row) - theirs[block].row(row)).cwiseAbs().maxCoeff();
      if (worst <= relative * scales(row)) continue;  // false for NaN
      return failure("Jacobian of block ", block, ", row ", row, " is off by ", worst, " of ",
                     scales(row), "\n  analytic: ", ours[block].row(row).format(kRow), "\n  ",
                     other, ": ", theirs[block].row(row).format(kRow), "\n  at ", text_of(at));
    }
  }
  return {};
}

FactorReport compare_vectors(const Eigen::VectorXd& a, const Eigen::VectorXd& b, double tolerance,
                             const char* what) {
  if (a.size() == b.size() && a.size() > 0 && a.allFinite() && b.allFinite()) {
    const double scale = std::max(1.0, a.cwiseAbs().maxCoeff());
    if ((a - b).cwiseAbs().maxCoeff() <= tolerance * scale) return {};
  }
  return failure(what, ": ", a.transpose().format(kRow), " against ", b.transpose().format(kRow));
}

}  // namespace

FactorTester::FactorTester(const ceres::CostFunction& cost,
                           std::vector<const ceres::Manifold*> manifolds)
    : cost_(cost), manifolds_(std::move(manifolds)) {
  manifolds_.resize(cost_.parameter_block_sizes().size(), nullptr);
}

FactorTester::Evaluation FactorTester::evaluate(const ceres::CostFunction& cost, const Blocks& at,
                                                const std::vector<bool>& wanted) const {
  const auto& sizes = cost.parameter_block_sizes();
  std::vector<RowMajor> storage(sizes.size());
  std::vector<double*> pointers(sizes.size(), nullptr);
  bool any = false;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (i >= wanted.size() || !wanted[i]) continue;
    storage[i] = RowMajor::Constant(cost.num_residuals(), sizes[i], kNaN);
    pointers[i] = storage[i].data();
    any = true;
  }
  Evaluation result;
  result.residuals = Eigen::VectorXd::Constant(cost.num_residuals(), kNaN);
  result.good = cost.Evaluate(pointers_to(at).data(), result.residuals.data(),
                              any ? pointers.data() : nullptr);
  for (const auto& J : storage) result.jacobians.push_back(J);
  return result;
}

Eigen::VectorXd FactorTester::residuals(const Blocks& at) const {
  const Evaluation evaluation = evaluate(cost_, at, {});
  return evaluation.good ? evaluation.residuals : Eigen::VectorXd();
}

Eigen::MatrixXd FactorTester::to_tangent(const Eigen::MatrixXd& ambient, std::size_t block,
                                         const Blocks& at) const {
  const ceres::Manifold* manifold = manifolds_[block];
  if (manifold == nullptr) return ambient;
  RowMajor plus(manifold->AmbientSize(), manifold->TangentSize());
  manifold->PlusJacobian(at[block].data(), plus.data());
  return ambient * plus;
}

Blocks FactorTester::perturbed(const Blocks& at, double sigma, std::mt19937_64& random) const {
  Blocks result = at;
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const int size = static_cast<int>(at[i].size());
    const int tangent = manifolds_[i] ? manifolds_[i]->TangentSize() : size;
    Eigen::VectorXd step(tangent);
    for (double& d : step) d = sigma * normal(random);
    if (manifolds_[i]) {
      manifolds_[i]->Plus(at[i].data(), step.data(), result[i].data());
    } else {
      for (int k = 0; k < size; ++k) result[i][static_cast<std::size_t>(k)] += step(k);
    }
  }
  return result;
}

FactorReport FactorTester::is_zero(const Blocks& at, double tolerance) const {
  return residual_is(at, Eigen::VectorXd::Zero(cost_.num_residuals()), tolerance);
}

FactorReport FactorTester::residual_is(const Blocks& at, const Eigen::VectorXd& expected,
                                       double tolerance) const {
  return compare_vectors(residuals(at), expected, tolerance, "residual against expected");
}

bool FactorTester::differentiate(const Blocks& at, std::vector<Eigen::MatrixXd>& analytic,
                                 std::vector<Eigen::MatrixXd>& numeric) const {
  ceres::NumericDiffOptions options;
  options.ridders_relative_initial_step_size = 1e-3;
  const ceres::GradientChecker checker(&cost_, &manifolds_, options);
  ceres::GradientChecker::ProbeResults probe;
  checker.Probe(pointers_to(at).data(), 1, &probe);
  if (!probe.return_value) return false;
  for (std::size_t i = 0; i < manifolds_.size(); ++i) {
    analytic.push_back(probe.local_jacobians[i]);
    numeric.push_back(probe.local_numeric_jacobians[i]);
  }
  return true;
}

FactorReport FactorTester::gradients_agree(const Blocks& at, double relative) const {
  // Probe's own verdict divides by each entry, also by those that are zero but for rounding; here
  // a difference is measured by the largest entry of its row.
  std::vector<Eigen::MatrixXd> ours, numeric;
  if (!differentiate(at, ours, numeric)) {
    return failure("Evaluate failed at or near ", text_of(at));
  }
  return compare_jacobians(ours, numeric, relative, "numeric ", at);
}

FactorReport FactorTester::agrees_with(const ceres::CostFunction& twin, const Blocks& at,
                                       double relative) const {
  const std::vector<bool> all(manifolds_.size(), true);
  const Evaluation a = evaluate(cost_, at, all), b = evaluate(twin, at, all);
  if (!a.good || !b.good) return failure("Evaluate failed at ", text_of(at));
  if (auto same = compare_vectors(a.residuals, b.residuals, relative, "residual against twin's");
      !same) {
    return failure(same.text, "\n  at ", text_of(at));
  }
  std::vector<Eigen::MatrixXd> ours, theirs;
  for (std::size_t i = 0; i < manifolds_.size(); ++i) {
    ours.push_back(to_tangent(a.jacobians[i], i, at));
    theirs.push_back(to_tangent(b.jacobians[i], i, at));
  }
  return compare_jacobians(ours, theirs, relative, "autodiff", at);
}

FactorReport FactorTester::null_jacobians_allowed(const Blocks& at) const {
  const std::size_t blocks = manifolds_.size();
  const Evaluation full = evaluate(cost_, at, std::vector<bool>(blocks, true));
  if (!full.good) return failure("Evaluate failed at ", text_of(at));
  if (!same_numbers(evaluate(cost_, at, {}).residuals, full.residuals)) {
    return failure("residuals differ, or are not all written, without Jacobians at ", text_of(at));
  }
  for (std::size_t i = 0; i < blocks; ++i) {
    std::vector<bool> wanted(blocks, false);
    wanted[i] = true;
    const Evaluation one = evaluate(cost_, at, wanted);
    if (!one.good || !same_numbers(one.residuals, full.residuals) ||
        !same_numbers(one.jacobians[i], full.jacobians[i])) {
      return failure("asked for the Jacobian of block ", i,
                     " alone: values differ, or are not all written, at ", text_of(at));
    }
  }
  return {};
}

FactorReport FactorTester::same_residuals(const Blocks& a, const Blocks& b,
                                          double tolerance) const {
  return compare_vectors(residuals(a), residuals(b), tolerance, "residuals before and after");
}

FactorReport FactorTester::unchanged_when_moved(
    const Blocks& at, const std::function<Blocks(const SE3&, const Blocks&)>& moved,
    double tolerance, std::uint64_t seed) const {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) {
    return Eigen::Vector3d(sigma * normal(random), sigma * normal(random), sigma * normal(random));
  };
  for (int i = 0; i < 10; ++i) {
    const SO3 R = SO3::exp(draw(2));  // rotations of all sizes, some metres
    const SE3 T_new_old(R, draw(5));
    if (auto same = same_residuals(at, moved(T_new_old, at), tolerance); !same) {
      return failure(same.text, "\n  move ", i, " of seed ", seed, ", at ", text_of(at));
    }
  }
  return {};
}

FactorReport FactorTester::fails_consistently(const Blocks& at) const {
  const std::size_t blocks = manifolds_.size();
  for (std::size_t i = 0; i <= blocks; ++i) {
    std::vector<bool> wanted(blocks, i == blocks);
    if (i < blocks) wanted[i] = true;
    if (!evaluate(cost_, at, wanted).good && !evaluate(cost_, at, {}).good) continue;
    return failure("Evaluate fails or not by what Jacobians are asked for, at ", text_of(at));
  }
  return {};
}

FactorReport FactorTester::check_at(const Blocks& at, const FactorCheck& check) const {
  FactorReport result = null_jacobians_allowed(at);
  if (result) result = gradients_agree(at, check.gradient);
  if (result && check.autodiff_twin) result = agrees_with(*check.autodiff_twin, at, check.twin);
  return result;
}

FactorReport FactorTester::check_all(const std::vector<Blocks>& at,
                                     const FactorCheck& check) const {
  if (at.empty()) return failure("no point to check at");
  std::mt19937_64 random(check.seed);
  std::vector<Blocks> points = at;
  for (int i = 0; i < check.points; ++i) {
    points.push_back(perturbed(at[static_cast<std::size_t>(i) % at.size()], check.spread, random));
  }
  std::size_t failed = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::vector<bool> all(manifolds_.size(), true);
    const bool fails = check.may_fail && (!evaluate(cost_, points[i], {}).good ||
                                          !evaluate(cost_, points[i], all).good);
    std::vector<Eigen::MatrixXd> ours, numeric;  // steps of numeric differences may fail, too
    const bool passed_over = fails || (check.may_fail && !differentiate(points[i], ours, numeric));
    FactorReport result;
    if (fails) result = fails_consistently(points[i]);
    if (!passed_over) result = check_at(points[i], check);
    if (!result) return failure(result.text, "\n  point ", i, " of seed ", check.seed);
    failed += passed_over;
  }
  if (2 * failed > points.size()) {
    return failure("Evaluate failed at ", failed, " of ", points.size(), " points");
  }
  return {};
}

}  // namespace lamina
