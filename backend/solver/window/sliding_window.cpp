// The window's evidence and bookkeeping.
#include <lamina/backend/solver/window/sliding_window.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {

// ------------------------------------------------------------------------------- evidence

SlidingWindow::SlidingWindow(const WindowOptions& options)
    : options_(options), engine_(make_window_engine(options.engine)) {
  LAMINA_CHECK(options.problems().empty());
}

void SlidingWindow::add_keyframe(KeyframeId id, Timestamp stamp, const SE3& T_map_body) {
  LAMINA_CHECK(!contains(id));
  const PoseState pose(T_map_body);
  state_.poses.push_back({id, stamp, pose, pose, false});
  ++keyframes_added_;
  solved_ = false;
}

bool SlidingWindow::add_plane(PlaneId id, const Plane& plane_anchor,
                              const Eigen::Vector3d& anchor_map,
                              const std::optional<Eigen::Matrix3d>& covariance) {
  LAMINA_CHECK(!contains(id));
  if (take_back(id, plane_anchor, anchor_map)) return true;
  forget(id);
  const PlaneState plane(plane_anchor);
  state_.planes.push_back(
      {id, anchor_map, plane, plane, false, KeyframeId::kNone, keyframes_added_});
  solved_ = false;
  if (!covariance || !covariance->allFinite()) return false;
  const Eigen::Matrix3d inflated = options_.return_inflation * *covariance;
  const Eigen::LLT<Eigen::Matrix3d> llt(inflated);
  if (llt.info() != Eigen::Success) return false;
  const Eigen::Matrix3d S = llt.matrixL().solve(Eigen::Matrix3d::Identity());
  if (S.allFinite()) state_.plane_priors.push_back({state_.next_serial(), id, plane, S});
  return false;
}

bool SlidingWindow::add_prior(PlaneId id, const Plane& at, double sigma_tilt, double sigma_rho) {
  if (!contains(id) || !(sigma_tilt > 0) || !(sigma_rho > 0)) return false;
  const Eigen::Vector3d inverse(1 / sigma_tilt, 1 / sigma_tilt, 1 / sigma_rho);
  // Its basis is turned as little as may be from the landmark's own: residuals compare the two.
  const PlaneState& now = state_.planes[static_cast<std::size_t>(find(id))].now;
  PlaneState held(at);
  const Eigen::Vector3d b0 = now.B.col(0);
  held.B.col(0) = (b0 - b0.dot(held.n) * held.n).normalized();
  held.B.col(1) = held.n.cross(Eigen::Vector3d(held.B.col(0)));
  state_.plane_priors.push_back({state_.next_serial(), id, held, inverse.asDiagonal()});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const PriorFactor& factor) {
  if (!contains(factor.keyframe)) return false;
  state_.pose_priors.push_back({state_.next_serial(), factor.keyframe, PriorTerm(factor)});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const OdometryFactor& factor) {
  if (!contains(factor.from) || !contains(factor.to) || factor.from == factor.to) return false;
  state_.relative_poses.push_back(
      {state_.next_serial(), factor.from, factor.to, OdometryTerm(factor), false, 1});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const LoopFactor& factor) {
  if (!contains(factor.from) || !contains(factor.to) || factor.from == factor.to) return false;
  OdometryTerm term(factor);
  term.sqrt_information *= std::sqrt(std::max(0.0, factor.weight));
  state_.relative_poses.push_back({state_.next_serial(), factor.from, factor.to, term, true, 1});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const GravityFactor& factor) {
  if (!contains(factor.keyframe) || !(factor.sigma > 0)) return false;
  state_.gravity.push_back({state_.next_serial(), factor.keyframe, GravityTerm(factor)});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const CustomFactor& factor) {
  std::vector<KeyframeId> keyframes;
  for (const StateRef& state : factor.states) {
    const KeyframeId* id = std::get_if<KeyframeId>(&state);
    if (id == nullptr || !contains(*id)) return false;
    keyframes.push_back(*id);
  }
  if (keyframes.empty() || !(factor.weight > 0)) return false;
  state_.custom.push_back({state_.next_serial(), keyframes, factor});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const PlaneMomentsFactor& factor) {
  const int plane = find(factor.plane);
  const Moments& m = factor.moments_body;
  if (plane < 0 || !contains(factor.keyframe)) return false;
  if (!m.scatter().allFinite() || !m.mean().allFinite() || !std::isfinite(m.weight())) return false;
  const Eigen::Vector3d& anchor = state_.planes[static_cast<std::size_t>(plane)].anchor;
  state_.views.push_back({state_.next_serial(), factor.keyframe, factor.plane,
                          PlaneMomentsTerm(m.scaled(std::max(0.0, factor.weight)), anchor), 1});
  state_.planes[static_cast<std::size_t>(plane)].last_seen = factor.keyframe;
  state_.planes[static_cast<std::size_t>(plane)].idle_since = keyframes_added_;
  solved_ = false;
  return true;
}

bool SlidingWindow::set(const PlaneMomentsFactor& factor) {
  std::erase_if(state_.views, [&](const window::PlaneView& s) {
    return s.keyframe == factor.keyframe && s.plane == factor.plane;
  });
  return add(factor);
}

bool SlidingWindow::add_surfel(SurfelId id, const SE3& T_map_cell,
                               const SurfelParentFactor& parent) {
  const int plane = find(parent.plane);
  if (plane < 0 || contains(id)) return false;
  LAMINA_CHECK(state_.surfels.empty() || state_.surfels.back().id < id);
  const Eigen::Vector3d& anchor = state_.planes[static_cast<std::size_t>(plane)].anchor;
  state_.surfels.push_back({state_.next_serial(),
                            id,
                            FlatState(),
                            parent.plane,
                            SurfelParentTerm(parent, T_map_cell, anchor),
                            {}});
  return true;
}

bool SlidingWindow::set(const SurfelMomentsFactor& factor) {
  const int at = state_.find(factor.surfel);
  const Moments& m = factor.moments_body;
  if (at < 0 || !contains(factor.keyframe)) return false;
  if (!m.scatter().allFinite() || !m.mean().allFinite() || !std::isfinite(m.weight())) return false;
  window::Surfel& surfel = state_.surfels[static_cast<std::size_t>(at)];
  std::erase_if(surfel.views, [&](const auto& view) { return view.keyframe == factor.keyframe; });
  const SE3 T_map_cell(SO3(Eigen::Quaterniond(surfel.tie.R_body_cell)), surfel.tie.t_body_cell);
  surfel.views.push_back({state_.next_serial(), factor.keyframe, SurfelMomentsTerm(m, T_map_cell)});
  solved_ = false;
  return true;
}

bool SlidingWindow::rename_plane(PlaneId from, PlaneId into) {
  if (find(from) < 0 || find(into) >= 0) return false;
  forget(from);
  forget(into);
  const auto rename = [from, into](PlaneId& id) {
    if (id == from) id = into;
  };
  for (auto& plane : state_.planes) rename(plane.id);
  for (auto& prior : state_.plane_priors) rename(prior.id);
  for (auto& view : state_.views) rename(view.plane);
  for (auto& surfel : state_.surfels) rename(surfel.parent);
  for (auto& id : state_.prior.planes) rename(id);
  state_.renew_serials();
  return true;
}

WindowReport SlidingWindow::solve() {
  const WindowReport report = engine_.one->solve(state_, options_, system_);
  solved_ = report.finite;
  return report;
}

}  // namespace lamina
