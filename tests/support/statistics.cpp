// Monte-Carlo checks of covariances.
#include "support/statistics.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include <lamina/testing/whiteness.hpp>

namespace lamina::test {
namespace {
using testing::AssertionFailure;
using testing::AssertionResult;
using testing::AssertionSuccess;
const Eigen::IOFormat kRow(10, 0, ", ", "; ", "", "", "[", "]");
}  // namespace

AssertionResult has_unit_covariance(const std::function<Eigen::VectorXd(Random&)>& draw,
                                    int samples, std::uint64_t seed) {
  Random random(seed);
  Whiteness residuals;
  for (int i = 0; i < samples; ++i) residuals.add(draw(random));
  if (residuals.white()) return AssertionSuccess();
  return AssertionFailure() << "whitened residuals of seed " << seed << " have mean "
                            << residuals.mean().transpose().format(kRow) << " and covariance "
                            << residuals.covariance().format(kRow);
}

AssertionResult is_consistent(const std::function<ErrorAndCovariance(Random&)>& draw, int samples,
                              std::uint64_t seed) {
  Random random(seed);
  double sum = 0;
  Eigen::Index degrees = 0;
  for (int i = 0; i < samples; ++i) {
    const auto [error, covariance] = draw(random);
    degrees = error.size();
    sum += error.dot(covariance.ldlt().solve(error));
  }
  const double mean = sum / samples;
  const double band = 3.29 * std::sqrt(2.0 * static_cast<double>(degrees) / samples);
  if (std::abs(mean - static_cast<double>(degrees)) < band) return AssertionSuccess();
  return AssertionFailure() << "normalised squared error of seed " << seed << " averages " << mean
                            << ", expected " << degrees << " +- " << band;
}

}  // namespace lamina::test
