// Seeded random numbers, rotations, poses, planes and points.
#include "support/random.hpp"

#include <cmath>

namespace lamina::test {

double Random::uniform(double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(engine_);
}

int Random::integer(int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(engine_);
}

double Random::normal(double sigma) { return sigma * std::normal_distribution<double>()(engine_); }

Eigen::VectorXd Random::normal_vector(int size, double sigma) {
  Eigen::VectorXd v(size);
  for (int i = 0; i < size; ++i) v(i) = normal(sigma);
  return v;
}

Eigen::Vector3d Random::normal3(double sigma) { return normal_vector(3, sigma); }

Eigen::Vector3d Random::in_cube(double half) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v(i) = uniform(-half, half);
  return v;
}

Eigen::Vector3d Random::unit_vector() {
  Eigen::Vector3d v;
  do {
    v = normal3();
  } while (v.norm() < 1e-6);
  return v.normalized();
}

SO3 Random::rotation() {
  const Eigen::VectorXd v = normal_vector(4);
  return SO3(Eigen::Quaterniond(v(0), v(1), v(2), v(3)));
}

SO3 Random::rotation_of(double angle) { return SO3::exp(angle * unit_vector()); }

SE3 Random::pose(double half_side) {
  const SO3 R = rotation();
  return SE3(R, in_cube(half_side));
}

Plane Random::plane(double largest_rho) {
  const Eigen::Vector3d n = unit_vector();
  return Plane(n, uniform(-largest_rho, largest_rho));
}

std::vector<Eigen::Vector3d> Random::points_on(const Plane& plane, const Eigen::Vector3d& center,
                                               double radius, int count, double sigma) {
  const Eigen::Vector3d foot = plane.project(center);
  const Matrix32d B = plane.tangent_basis();
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double r = radius * std::sqrt(uniform(0, 1)), angle = uniform(-M_PI, M_PI);
    const Eigen::Vector2d in_plane(r * std::cos(angle), r * std::sin(angle));
    points.push_back(foot + B * in_plane + normal(sigma) * plane.normal());
  }
  return points;
}

}  // namespace lamina::test
