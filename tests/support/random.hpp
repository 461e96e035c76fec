// Seeded random numbers, rotations, poses, planes and points.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/plane.hpp>

namespace lamina::test {

/// Everything a test draws comes from one of these; the seed stands in the test.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high);
  int integer(int low, int high);  ///< both inclusive
  double normal(double sigma = 1.0);
  Eigen::VectorXd normal_vector(int size, double sigma = 1.0);
  Eigen::Vector3d normal3(double sigma = 1.0);
  /// In the cube [-half, half]^3.
  Eigen::Vector3d in_cube(double half);
  Eigen::Vector3d unit_vector();  ///< even on the sphere
  SO3 rotation();                 ///< even on SO(3)
  SO3 rotation_of(double angle);  ///< about a random axis
  SE3 pose(double half_side);     ///< any rotation, translation in the cube
  Plane plane(double largest_rho);
  /// Points on a plane: evenly in a disc about the foot of `center`, with normal noise of sigma
  /// along the normal.
  std::vector<Eigen::Vector3d> points_on(const Plane& plane, const Eigen::Vector3d& center,
                                         double radius, int count, double sigma = 0);

 private:
  std::mt19937_64 engine_;
};

}  // namespace lamina::test
