// The Monte-Carlo checks find sigmas that are too large or too small.
#include "support/statistics.hpp"

#include <gtest/gtest.h>

namespace lamina::test {
namespace {

TEST(Statistics, UnitCovariance) {
  EXPECT_TRUE(has_unit_covariance([](Random& random) { return random.normal_vector(3); }));
  EXPECT_FALSE(has_unit_covariance([](Random& random) { return random.normal_vector(3, 1.2); }));
  EXPECT_FALSE(has_unit_covariance(
      [](Random& random) { return Eigen::VectorXd(random.normal_vector(3).array() + 0.2); }));
}

TEST(Statistics, Consistency) {
  const auto draw_of = [](double sigma) {
    return [sigma](Random& random) {
      const Eigen::VectorXd error = random.normal_vector(2, sigma);
      return ErrorAndCovariance{error, 4.0 * Eigen::MatrixXd::Identity(2, 2)};
    };
  };
  EXPECT_TRUE(is_consistent(draw_of(2.0)));
  EXPECT_FALSE(is_consistent(draw_of(2.4)));
  EXPECT_FALSE(is_consistent(draw_of(1.6)));
}

}  // namespace
}  // namespace lamina::test
