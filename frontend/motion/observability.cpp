// Variances of wheels over a metre, with and without what was seen.
#include <lamina/frontend/motion/observability.hpp>

#include <Eigen/Cholesky>
#include <algorithm>

#include <lamina/frontend/motion/depth_odometry.hpp>

namespace lamina {

LeftToWheels left_to_wheels(const Matrix6d& seen, const Matrix6d& by_wheels,
                            const SE3& T_prev_curr) {
  constexpr double kLeast = 1e-3;  // m: of less way nothing can be said, nor need be
  constexpr double kHalf = 0.5;    // of the variance: both tell as much
  const double way = T_prev_curr.translation().norm();
  if (!(way > kLeast)) return {};
  Matrix6d metre = by_wheels * std::max(1.0, 1 / way);
  metre.diagonal().array() += 1e-12;
  const Matrix6d identity = Matrix6d::Identity();
  const Matrix6d both = (seen + metre.ldlt().solve(identity)).ldlt().solve(identity);
  Vector6d along = Vector6d::Zero();
  along.head<3>() = T_prev_curr.translation() / way;
  return {along.dot(both * along) > kHalf * along.dot(metre * along),
          both(5, 5) > kHalf * metre(5, 5)};
}

LeftToWheels left_to_wheels(const DepthMotion& motion, const MotionGuess& wheels) {
  const Matrix6d nothing = Matrix6d::Zero();
  return left_to_wheels(motion.doubtful ? nothing : motion.image_information, wheels.covariance,
                        motion.T_prev_curr_body);
}

}  // namespace lamina
