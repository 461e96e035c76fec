// A factor and a state of one's own: ranges to a radio beacon whose place nobody knows.
#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>

#include <cmath>
#include <cstdio>
#include <random>

#include <lamina/lamina.hpp>

// (|beacon - t| - range) / sigma.
struct Range {
  double range, sigma;
  template <class T>
  bool operator()(const T* pose, const T* beacon, T* r) const {
    T squares(0);
    for (int i = 0; i < 3; ++i) squares += (beacon[i] - pose[i]) * (beacon[i] - pose[i]);
    r[0] = (sqrt(squares) - range) / sigma;
    return true;
  }
};

int main() try {
  const Eigen::Vector3d beacon(3, -2, 1.5);  // the truth, which ranges tell to 5 cm each
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.05);
  lamina::Mapper mapper;
  lamina::CustomState place;
  place.values = Eigen::Vector3d(0.5, 0.5, 0.5);  // a poor guess
  const lamina::CustomStateId id = mapper.add_state(place);
  const lamina::Matrix6d wheels = lamina::Matrix6d::Identity() * 1e-4;
  for (int i = 0; i < 60; ++i) {  // up a spiral, whose height tells the beacon's
    lamina::Observations nothing;
    nothing.stamp = lamina::Timestamp::from_seconds(i);
    const lamina::SE3 step(lamina::SO3::rot_z(i == 0 ? 0 : 0.15), {i == 0 ? 0 : 0.5, 0, 0.04});
    const lamina::AddResult at = mapper.add(nothing, step, wheels);
    if (!at.is_keyframe) continue;
    lamina::CustomFactor factor;
    factor.kind = "range";
    factor.states = {at.keyframe, id};
    const double range = (beacon - at.T_map_body.translation()).norm() + noise(random);
    factor.cost = std::make_shared<ceres::AutoDiffCostFunction<Range, 1, 7, 3>>(
        new Range{range + (i == 30 ? 5 : 0), 0.05});  // one of them met a wall first
    factor.may_be_wrong = true;
    mapper.add_factor(factor);
  }
  const lamina::RefineResult result = mapper.refine();
  const Eigen::VectorXd found = mapper.graph().at(id).values;
  std::printf("beacon at %.2f %.2f %.2f m, %zu of its ranges left out\n", found(0), found(1),
              found(2), result.rejected.size());
  return (found - beacon).norm() < 0.2 && result.rejected.size() == 1 ? 0 : 1;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
