// A constant error of disparities, by floors and by walls that are met again after a motion.
#include <algorithm>
#include <cmath>

#include <lamina/frontend/depth/mounting_check.hpp>

namespace lamina {
namespace {

double square(double x) { return x * x; }

// Two views from places far enough apart that an offset shows, near enough to meet walls again.
struct ViewPair {
  std::size_t from, to;
  SE3 T_to_from;  // by wheels
};

std::vector<ViewPair> pairs_of(const std::vector<MountingView>& views) {
  constexpr double kLeastWay = 0.3, kMostWay = 2, kMostTurn = 1;  // m, rad
  std::vector<ViewPair> pairs;
  for (std::size_t to = 0; to < views.size(); ++to) {
    for (std::size_t from = 0; from < to; ++from) {
      if (!views[from].T_odom_body || !views[to].T_odom_body) continue;
      const SE3 T = views[to].T_odom_body->inverse() * *views[from].T_odom_body;
      const double way = T.translation().norm();
      if (way > kLeastWay && way < kMostWay && T.so3().log().norm() < kMostTurn)
        pairs.push_back({from, to, T});
    }
  }
  return pairs;
}

using Costs = std::vector<double>;  // of blocks

double sum(const Costs& costs) {
  double all = 0;
  for (const double cost : costs) all += cost;
  return all;
}

// Where costs (of blocks, without one of them) are least.
std::size_t least(const std::vector<Costs>& all, std::size_t without) {
  const auto cost = [without](const Costs& costs) {
    return sum(costs) - (without < costs.size() ? costs[without] : 0);
  };
  return static_cast<std::size_t>(
      std::min_element(all.begin(), all.end(),
                       [&](const Costs& a, const Costs& b) { return cost(a) < cost(b); }) -
      all.begin());
}

// Of a parabola through three costs about the least of them, in steps from it.
double vertex(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend > 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

}  // namespace

// Of walls: the floor lies the same after any motion. Compared as measured: an offset that draws
// all walls nearer would else shrink what they are off, too.
double MountingCheck::meets_again(const CameraCorrection& c, std::size_t from, std::size_t to,
                                  const SE3& T_camera_to_from) const {
  const double upright = std::cos(options_.most_tilt);
  const double way = T_camera_to_from.translation().norm();
  double cost = 0;
  for (const MountingView::Seen& seen : views_[from].planes) {
    const Plane before = corrected(seen.plane_camera, c);
    if (std::abs((c.T_body_camera->so3() * before.normal()).z()) > upright) continue;
    CameraCorrection undone;
    undone.offset = -c.offset;
    const Plane expected = corrected(T_camera_to_from * before, undone);
    double misfit = options_.truncate;
    for (const MountingView::Seen& other : views_[to].planes) {
      const Plane& plane = other.plane_camera;
      misfit = std::min(
          misfit, square(angle_between(plane, expected) / options_.sigma_wall_tilt) +
                      square((plane.rho() - expected.rho()) / options_.sigma_wall / (1 + way)));
    }
    cost += misfit;
  }
  return cost;
}

namespace {

// Costs by blocks of `steps` values below and above the middle one.
template <class CostsAt>
std::vector<Costs> swept(int steps, const CostsAt& costs_at) {
  std::vector<Costs> all;
  for (int k = -steps; k <= steps; ++k) all.push_back(costs_at(static_cast<double>(k) / steps));
  return all;
}

// By costs of offsets, of which the middle one is none, in steps.
DepthOffset best_of(const std::vector<Costs>& offsets) {
  const std::size_t none = offsets.size() / 2, blocks = offsets.front().size();
  const std::size_t best = least(offsets, blocks);
  DepthOffset found;
  BlockGains gains;
  for (std::size_t k = 0; k < blocks; ++k)
    gains.add(offsets[none][k] - offsets[least(offsets, k)][k]);
  found.adoption = gains.judge();
  found.gain = sum(offsets[none]) - sum(offsets[best]);
  found.value = static_cast<double>(best) - static_cast<double>(none);
  found.clear = best > 0 && best + 1 < offsets.size();
  if (found.clear)
    found.value += vertex(sum(offsets[best - 1]), sum(offsets[best]), sum(offsets[best + 1]));
  return found;
}

// Of a mounting that is as stated but for a tape measure's errors; one fact, however far off.
double prior_cost(const SE3& stated, const SE3& T_body_camera,
                  const MountingCheckOptions& options) {
  const double height = stated.translation().z();
  const double turned = (stated.inverse() * T_body_camera).so3().log().norm();
  const double off = square(turned / options.sigma_tilt) +
                     square((T_body_camera.translation().z() - height) /
                            (options.sigma_height * height + options.sigma_height_m));
  return std::min(off, options.truncate);
}

}  // namespace

std::optional<DepthOffset> MountingCheck::depth_offset() const {
  const std::vector<ViewPair> pairs = pairs_of(views_);
  const auto blocks = static_cast<std::size_t>(AdoptionOptions().least_blocks);
  if (views_.size() < blocks || pairs.size() < views_.size() || !height_stated_)
    return std::nullopt;
  const auto costs_of = [&](double offset, double wheels,
                            const std::optional<SE3>& T_body_camera = {}) {
    CameraCorrection c;
    c.offset = offset;
    c.T_body_camera = T_body_camera ? *T_body_camera : levelled(c);
    const SE3& T = *c.T_body_camera;
    Costs costs(blocks, prior_cost(T_body_camera_, T, options_) / static_cast<double>(blocks));
    for (const ViewPair& pair : pairs) {
      const SE3 way(pair.T_to_from.so3(), wheels * pair.T_to_from.translation());
      costs[pair.to * blocks / views_.size()] +=
          meets_again(c, pair.from, pair.to, T.inverse() * way * T);
    }
    return costs;
  };
  const auto offsets = swept(
      options_.steps, [&](double share) { return costs_of(share * options_.most_offset, 1); });
  const auto scales =
      swept(options_.steps, [&](double share) { return costs_of(0, std::exp2(2 * share)); });
  const MountingVerdict verdict = this->verdict();
  const double otherwise = std::min(sum(scales[least(scales, blocks)]),
                                    sum(costs_of(0, 1, verdict.best.correction.T_body_camera)));
  DepthOffset found = best_of(offsets);
  found.value *= options_.most_offset / options_.steps;
  found.clear = found.clear && sum(offsets[least(offsets, blocks)]) + options_.clear_by < otherwise;
  return found;
}

}  // namespace lamina
