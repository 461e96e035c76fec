// Monte-Carlo checks of covariances.
#include "support/statistics.hpp"

#include <Eigen/Cholesky>
#include <cmath>

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
  Eigen::VectorXd sum;
  Eigen::MatrixXd squares;
  for (int i = 0; i < samples; ++i) {
    const Eigen::VectorXd r = draw(random);
    if (i == 0) {
      sum = Eigen::VectorXd::Zero(r.size());
      squares = Eigen::MatrixXd::Zero(r.size(), r.size());
    }
    sum += r;
    squares += r * r.transpose();
  }
  const double n = samples;
  const double worst_mean = (sum / n).cwiseAbs().maxCoeff();
  const auto unit = Eigen::MatrixXd::Identity(sum.size(), sum.size());
  const double worst_covariance = (squares / n - unit).cwiseAbs().maxCoeff();
  // Standard errors: 1/sqrt(n) of a mean, sqrt(2/n) of a variance, 1/sqrt(n) of a covariance.
  if (worst_mean < 5 / std::sqrt(n) && worst_covariance < 5 * std::sqrt(2 / n)) {
    return AssertionSuccess();
  }
  return AssertionFailure() << "whitened residuals of seed " << seed << " have mean "
                            << (sum / n).transpose().format(kRow) << " and covariance "
                            << (squares / n).format(kRow);
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
