// The window's states, evidence and Gauss-Newton steps.
#include <lamina/backend/solver/window/sliding_window.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/models/linalg.hpp>

namespace lamina {

std::vector<std::string> WindowOptions::problems() const {
  std::vector<std::string> result;
  const auto require = [&result](bool holds, const char* text) {
    if (!holds) result.emplace_back(text);
  };
  require(keyframes >= 3, "window.keyframes: expected at least 3");
  require(seconds >= 0, "window.seconds: expected 0 (no limit) or more");
  require(idle_keyframes >= 0, "window.idle_keyframes: expected 0 or more");
  require(max_planes >= 1, "window.max_planes: expected at least 1");
  require(planes_behind >= 0, "window.planes_behind: expected 0 or more");
  require(iterations >= 1, "window.iterations: expected at least 1");
  require(stop_chi_squared > 0, "window.stop_chi_squared: expected more than 0");
  require(robust_chi_squared > 0, "window.robust_chi_squared: expected more than 0");
  require(return_inflation >= 1, "window.return_inflation: expected 1 or more");
  return result;
}

// ------------------------------------------------------------------------------- charts

SlidingWindow::Chart SlidingWindow::Chart::boxplus(const Eigen::Vector3d& d) const {
  const Eigen::Vector3d axis = normal.cross(basis * d.head<2>());
  const SO3 turn = SO3::exp(axis);
  Chart result;
  result.normal = (turn * normal).normalized();
  const Eigen::Vector3d b0 = turn * Eigen::Vector3d(basis.col(0));
  result.basis.col(0) = (b0 - b0.dot(result.normal) * result.normal).normalized();
  result.basis.col(1) = result.normal.cross(Eigen::Vector3d(result.basis.col(0)));
  result.rho = rho + d.z();
  return result;
}

Eigen::Vector3d SlidingWindow::Chart::boxminus(const Chart& origin) const {
  const Eigen::Vector2d s = origin.basis.transpose() * normal;
  const double sine = s.norm(), cosine = origin.normal.dot(normal);
  Eigen::Vector3d d;
  const double angle = std::atan2(sine, cosine);
  d.head<2>() = sine > 1e-12 ? Eigen::Vector2d(s * (angle / sine)) : s;
  d.z() = rho - origin.rho;
  return d;
}

// ------------------------------------------------------------------------------- evidence

SlidingWindow::SlidingWindow(const WindowOptions& options) : options_(options) {
  LAMINA_CHECK(options.problems().empty());
}

int SlidingWindow::find(KeyframeId id) const {
  for (std::size_t i = poses_.size(); i-- > 0;) {
    if (poses_[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

int SlidingWindow::find(PlaneId id) const {
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    if (planes_[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

void SlidingWindow::add_keyframe(KeyframeId id, Timestamp stamp, const SE3& T_map_body) {
  LAMINA_CHECK(!contains(id));
  poses_.push_back({id, stamp, T_map_body, T_map_body, false});
  ++keyframes_added_;
  solved_ = false;
}

bool SlidingWindow::add_plane(PlaneId id, const Plane& plane_anchor,
                              const Eigen::Vector3d& anchor_map,
                              const std::optional<Eigen::Matrix3d>& covariance) {
  LAMINA_CHECK(!contains(id));
  if (take_back(id, plane_anchor, anchor_map)) return true;
  forget(id);
  const Chart chart{plane_anchor.normal(), plane_anchor.tangent_basis(), plane_anchor.rho()};
  planes_.push_back({id, anchor_map, chart, chart, false, KeyframeId::kNone, keyframes_added_});
  solved_ = false;
  if (!covariance || !covariance->allFinite()) return false;
  const Eigen::Matrix3d inflated = options_.return_inflation * *covariance;
  const Eigen::LLT<Eigen::Matrix3d> llt(inflated);
  if (llt.info() != Eigen::Success) return false;
  const Eigen::Matrix3d S = llt.matrixL().solve(Eigen::Matrix3d::Identity());
  if (S.allFinite()) holds_.push_back({id, chart, S});
  return false;
}

bool SlidingWindow::add_prior(PlaneId id, const Plane& at, double sigma_tilt, double sigma_rho) {
  if (!contains(id) || !(sigma_tilt > 0) || !(sigma_rho > 0)) return false;
  const Eigen::Vector3d inverse(1 / sigma_tilt, 1 / sigma_tilt, 1 / sigma_rho);
  // Its basis is turned as little as may be from the landmark's own: residuals compare the two.
  const Chart& now = planes_[static_cast<std::size_t>(find(id))].now;
  Chart chart{at.normal(), now.basis, at.rho()};
  const Eigen::Vector3d b0 = now.basis.col(0);
  chart.basis.col(0) = (b0 - b0.dot(chart.normal) * chart.normal).normalized();
  chart.basis.col(1) = chart.normal.cross(Eigen::Vector3d(chart.basis.col(0)));
  holds_.push_back({id, chart, inverse.asDiagonal()});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const PriorFactor& factor) {
  if (!contains(factor.keyframe)) return false;
  singles_.push_back({factor.keyframe, factor.T_map_body, factor.sqrt_information});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const OdometryFactor& factor) {
  if (!contains(factor.from) || !contains(factor.to) || factor.from == factor.to) return false;
  betweens_.push_back(
      {factor.from, factor.to, factor.T_from_to, factor.sqrt_information, false, 1});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const LoopFactor& factor) {
  if (!contains(factor.from) || !contains(factor.to) || factor.from == factor.to) return false;
  betweens_.push_back({factor.from, factor.to, factor.T_from_to,
                       std::sqrt(std::max(0.0, factor.weight)) * factor.sqrt_information, true, 1});
  solved_ = false;
  return true;
}

bool SlidingWindow::add(const GravityFactor& factor) {
  if (!contains(factor.keyframe) || !(factor.sigma > 0)) return false;
  gravity_.push_back({factor.keyframe, factor.up_body, factor.sigma});
  solved_ = false;
  return true;
}

SlidingWindow::Sighting SlidingWindow::sighting(const PlaneMomentsFactor& factor) {
  const double share = std::max(0.0, factor.weight);
  const Moments& m = factor.moments_body;
  const SymmetricEigen<3> eigen = symmetric_eigen(Eigen::Matrix3d(m.scatter() * share));
  Sighting s;
  s.keyframe = factor.keyframe;
  s.plane = factor.plane;
  s.A = eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
  s.root_weight = std::sqrt(std::max(0.0, m.weight() * share));
  s.mean = m.mean();
  return s;
}

bool SlidingWindow::add(const PlaneMomentsFactor& factor) {
  const int plane = find(factor.plane);
  const Moments& m = factor.moments_body;
  if (plane < 0 || !contains(factor.keyframe)) return false;
  if (!m.scatter().allFinite() || !m.mean().allFinite() || !std::isfinite(m.weight())) return false;
  sightings_.push_back(sighting(factor));
  planes_[static_cast<std::size_t>(plane)].last_seen = factor.keyframe;
  planes_[static_cast<std::size_t>(plane)].idle_since = keyframes_added_;
  solved_ = false;
  return true;
}

bool SlidingWindow::set(const PlaneMomentsFactor& factor) {
  std::erase_if(sightings_, [&](const Sighting& s) {
    return s.keyframe == factor.keyframe && s.plane == factor.plane;
  });
  return add(factor);
}

bool SlidingWindow::rename_plane(PlaneId from, PlaneId into) {
  if (find(from) < 0 || find(into) >= 0) return false;
  forget(from);
  forget(into);
  const auto rename = [from, into](PlaneId& id) {
    if (id == from) id = into;
  };
  for (auto& plane : planes_) rename(plane.id);
  for (auto& hold : holds_) rename(hold.id);
  for (auto& sighting : sightings_) rename(sighting.plane);
  for (auto& id : prior_.planes) rename(id);
  return true;
}

void SlidingWindow::apply(const Eigen::VectorXd& d) {
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const Vector6d step = d.segment<6>(WindowSystem::pose_column(static_cast<int>(i)));
    poses_[i].now = poses_[i].now * SE3::exp(step);
  }
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const Eigen::Vector3d step = d.segment<3>(system_.plane_column(static_cast<int>(i)));
    planes_[i].now = planes_[i].now.boxplus(step);
  }
}

}  // namespace lamina
