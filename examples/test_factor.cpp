// Tests a factor of one's own before it goes into a map: Jacobians, noise, both engines.
#include <ceres/sized_cost_function.h>

#include <cmath>
#include <cstdio>

#include <lamina/testing/factor_tester.hpp>

// (bearing of a post on the floor, seen from a body that stands upright, - measured) / sigma.
class Bearing : public ceres::SizedCostFunction<1, 7, 2> {
 public:
  Bearing(double measured, double sigma) : measured_(measured), sigma_(sigma) {}
  bool Evaluate(double const* const* blocks, double* r, double** J) const override {
    const double *t = blocks[0], *q = blocks[0] + 3, *post = blocks[1];
    const double dx = post[0] - t[0], dy = post[1] - t[1], squared = dx * dx + dy * dy;
    if (squared < 1e-4) return false;  // on top of it no bearing is seen
    const double heading = 2 * std::atan2(q[2], q[3]), norm = q[2] * q[2] + q[3] * q[3];
    r[0] = std::remainder(std::atan2(dy, dx) - heading - measured_, 2 * M_PI) / sigma_;
    if (!J) return true;
    const double along[2] = {-dy / squared / sigma_, dx / squared / sigma_};
    if (J[0]) {
      const double turn = 2 / norm / sigma_;
      const double by_block[7] = {-along[0], -along[1], 0, 0, 0, -turn * q[3], turn * q[2]};
      std::copy(by_block, by_block + 7, J[0]);
    }
    if (J[1]) std::copy(along, along + 2, J[1]);
    return true;
  }

 private:
  double measured_, sigma_;
};

int main() {
  lamina::Graph graph;  // the truth: four keyframes around a post, whose place is a state
  lamina::CustomState post;
  post.values = Eigen::Vector2d(2, 1);
  graph.add_custom_state(post);
  std::normal_distribution<double> noise(0, 0.02);
  const auto seen_from = [&](int i, std::mt19937_64& random) {
    const double bearing = std::atan2(1 - 0.3 * i * i, 2 - i) - 0.2 * i;
    lamina::CustomFactor factor;
    factor.kind = "bearing";
    factor.states = {lamina::KeyframeId(i), lamina::CustomStateId(0)};
    factor.cost = std::make_shared<Bearing>(bearing + noise(random), 0.02);
    return factor;
  };
  std::mt19937_64 random(1);
  for (int i = 0; i < 4; ++i) {
    const lamina::SE3 T = lamina::SE3::planar(i, 0.3 * i * i, 0.2 * i);
    graph.add_keyframe(lamina::Timestamp::from_seconds(i), T);
    graph.priors.push_back({lamina::KeyframeId(i), T, lamina::Matrix6d::Identity() * 50});
    graph.custom.push_back(seen_from(i, random));
  }
  lamina::FactorCheck check;
  check.spread = 0.1;  // metres and radians about the truth
  int failures = 0;
  for (const lamina::FactorReport& report :
       {lamina::check_factor(graph.custom[1], graph, check),
        lamina::noise_is_as_stated(graph, [&](auto& draw) { return seen_from(1, draw); }),
        lamina::engines_agree(graph)}) {
    std::puts(report ? "passed" : report.text.c_str());
    failures += !report;
  }
  return failures;
}
