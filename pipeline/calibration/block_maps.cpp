// Steps cut by their stamps.
#include <lamina/pipeline/calibration/block_maps.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include <lamina/pipeline/calibration/wheel_intrinsics.hpp>

namespace lamina {

std::vector<QuadraticBlock> evidence_by_blocks(const std::vector<Step>& steps,
                                               const MapperOptions& options,
                                               const EvidenceOfMap& evidence,
                                               const std::function<bool()>& ended) {
  constexpr double kBlocks = 12;     // long blocks see walls from more sides
  constexpr std::size_t kLeast = 8;  // steps
  std::vector<QuadraticBlock> all;
  if (steps.empty()) return all;
  const Timestamp first = steps.front().observations.stamp;
  const double seconds = steps.back().observations.stamp - first;
  const double length = std::max(AdoptionOptions().block_s, seconds / kBlocks);
  SE3 T_map_body;
  for (std::size_t i = 0; i < steps.size() && !ended();) {
    std::vector<Step> block;
    const Timestamp end = steps[i].observations.stamp + length;
    for (; i < steps.size() && steps[i].observations.stamp < end; ++i) {
      T_map_body = T_map_body * steps[i].motion.T_from_to;
      block.push_back(steps[i]);
      if (block.size() == 1) block.front().motion.T_from_to = T_map_body;
    }
    if (block.size() < kLeast) continue;
    const auto found = evidence(quick_map(block, WheelErrors::Vector::Zero(), options, ended));
    if (found) all.push_back(*found);
  }
  return all;
}

QuadraticBlock without_prior(const Eigen::VectorXd& value, const Eigen::MatrixXd& covariance,
                             const Eigen::MatrixXd& prior) {
  const Eigen::MatrixXd H = covariance.inverse();
  return {H - prior, H * value};
}

}  // namespace lamina
