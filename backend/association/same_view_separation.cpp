// One plane through two views, or none.
#include <lamina/backend/association/same_view_separation.hpp>

#include <Eigen/Cholesky>
#include <cmath>

#include <lamina/models/linalg.hpp>

namespace lamina {

SameViewSeparation::SameViewSeparation(const Graph& graph, const AssociationOptions& options,
                                       double gate, double least_weight)
    : graph_(graph), lean_(1 / std::pow(options.max_angle_deg * M_PI / 180, 2)), gate_(gate) {
  for (const auto& f : graph.plane_moments) {
    if (f.weight >= least_weight) views_[f.plane][f.keyframe].merge(f.moments_body);
  }
}

std::optional<SameViewSeparation::Offset> SameViewSeparation::offset(PlaneId a, PlaneId b) const {
  const auto of_a = views_.find(a), of_b = views_.find(b);
  if (of_a == views_.end() || of_b == views_.end()) return std::nullopt;
  Offset offset;
  double weights = 0;
  for (const auto& [keyframe, view] : of_a->second) {
    const auto other = of_b->second.find(keyframe);
    if (other == of_b->second.end()) continue;
    const Eigen::Vector3d n_body =
        graph_.at(keyframe).T_map_body.so3().inverse() * graph_.at(b).plane_anchor.normal();
    const Eigen::Matrix3d held =
        lean_ * (Eigen::Matrix3d::Identity() - n_body * n_body.transpose());
    Moments both = view;
    both.merge(other->second);
    if (!(symmetric_eigen(Eigen::Matrix3d(both.scatter() + held)).values(0) > gate_)) continue;
    // Along the normal that both share: n of least n^T (S_a + S_b) n.
    const Eigen::Matrix3d own = view.scatter() + other->second.scatter() + held;
    const SymmetricEigen<3> eigen = symmetric_eigen(own);
    Eigen::Vector3d n = eigen.vectors.col(0);
    if (n.dot(n_body) < 0) n = -n;
    const Eigen::Vector3d arm = view.mean() - other->second.mean();
    const double one = 1 / view.weight() + 1 / other->second.weight() +
                       std::pow(eigen.vectors.col(1).dot(arm), 2) / eigen.values(1) +
                       std::pow(eigen.vectors.col(2).dot(arm), 2) / eigen.values(2);
    offset.mean += n.dot(arm) / one;
    weights += 1 / one;
    offset.seen_by.insert(keyframe);
  }
  if (offset.seen_by.empty()) return std::nullopt;
  offset.mean /= weights;
  offset.variance = static_cast<double>(offset.seen_by.size()) / weights;
  return offset;
}

}  // namespace lamina
