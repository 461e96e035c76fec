// Are estimates as sure as they say? Monte-Carlo checks of covariances.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>

#include "support/random.hpp"

namespace lamina::test {

/// Draws `samples` whitened residuals and checks that their mean is zero and their covariance the
/// unit matrix, each within five of its own standard errors (for normal noise).
testing::AssertionResult has_unit_covariance(const std::function<Eigen::VectorXd(Random&)>& draw,
                                             int samples = 2000, std::uint64_t seed = 3);

/// x^T P^-1 x of errors with their covariance, averaged over `draw`s, lies inside the two-sided
/// 99.9 % band of its chi-squared law (normal approximation): estimates are as sure as they say.
struct ErrorAndCovariance {
  Eigen::VectorXd error;
  Eigen::MatrixXd covariance;
};
testing::AssertionResult is_consistent(const std::function<ErrorAndCovariance(Random&)>& draw,
                                       int samples = 500, std::uint64_t seed = 3);

}  // namespace lamina::test
