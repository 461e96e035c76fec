// GMock matchers of our types: EXPECT_THAT(plane, IsNear(expected, 1e-9)). They print both sides
// and the difference.
#pragma once

#include <gmock/gmock.h>

#include <iosfwd>
#include <string>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/moments.hpp>
#include <lamina/models/plane.hpp>

namespace lamina {

/// What gtest shows of our types.
void PrintTo(const SO3& R, std::ostream* out);
void PrintTo(const SE3& T, std::ostream* out);
void PrintTo(const Plane& plane, std::ostream* out);
void PrintTo(const Moments& moments, std::ostream* out);

namespace test {

/// Largest difference, and what to say of it.
struct Difference {
  double largest = 0;
  std::string text;
};
Difference difference(const SO3& a, const SO3& b);      ///< of the tangent of a^-1 b, rad
Difference difference(const SE3& a, const SE3& b);      ///< of the tangent of a^-1 b, m and rad
Difference difference(const Plane& a, const Plane& b);  ///< of boxminus, rad and m
/// Weight and scatter relative to the expected, mean in metres, count exactly.
Difference difference(const Moments& a, const Moments& b);
Difference difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);  ///< of entries

/// Within `tolerance` of `expected` as difference() measures it; false for NaN.
MATCHER_P2(IsNear, expected, tolerance, "") {
  const Difference d = difference(arg, expected);
  *result_listener << "whose difference is " << d.text << ", largest " << d.largest;
  return d.largest <= tolerance;
}

}  // namespace test
}  // namespace lamina
