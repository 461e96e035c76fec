// Tangents of a level motion and a tilted one.
#include <lamina/frontend/motion/out_of_plane_motion.hpp>

#include <cmath>
#include <vector>

namespace lamina {
namespace {

void tilt_over(double way, Matrix6d& covariance) {
  constexpr double kTilt = 0.1;  // rad per square root of a metre: a ramp's whole slope in a length
  covariance(3, 3) += kTilt * kTilt * way;
  covariance(4, 4) += kTilt * kTilt * way;
}

}  // namespace

Increment tilting(Increment level) {
  tilt_over(level.T_from_to.translation().norm(), level.covariance);
  return level;
}

Increment open_to_slopes(Increment level, double way) {
  constexpr double kRise = 0.1;  // share of the way
  level.covariance(2, 2) += std::pow(kRise * way, 2);
  tilt_over(way, level.covariance);
  return level;
}

Lift Lift::between(const Increment& level, const Increment& observed) {
  Lift lift;
  const Vector6d off = (level.T_from_to.inverse() * observed.T_from_to).log();
  lift.off.segment<3>(2) = off.segment<3>(2);
  lift.variances = observed.covariance.diagonal().segment<3>(2);
  return lift;
}

Increment Lift::applied(Increment level, double share) const {
  level.T_from_to = level.T_from_to * SE3::exp(share * off);
  for (const int k : {2, 3, 4}) {
    level.covariance.row(k).setZero();
    level.covariance.col(k).setZero();
    level.covariance(k, k) = share * variances(k - 2);
  }
  return level;
}

double way_of(const Increment& motion) { return motion.T_from_to.translation().norm() + 1e-4; }

void share_out(const Increment& observed, std::span<Increment> motions) {
  constexpr int kRounds = 5;  // each leaves half the turn's share of what the last one left
  const std::vector<Increment> level(motions.begin(), motions.end());
  double all = 0;
  for (const Increment& one : level) all += way_of(one);
  Lift lift;
  for (int round = 0; round < kRounds; ++round) {
    Increment sum{SE3(), Matrix6d::Zero()};
    for (const Increment& one : motions) sum.T_from_to = sum.T_from_to * one.T_from_to;
    const Lift rest = Lift::between(sum, observed);
    lift.off += rest.off;
    lift.variances = rest.variances;
    for (std::size_t i = 0; i < motions.size(); ++i)
      motions[i] = lift.applied(level[i], way_of(level[i]) / all);
  }
}

}  // namespace lamina
