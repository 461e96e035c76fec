// The window's states, evidence and Gauss-Newton steps.
#include <lamina/backend/sliding_window.hpp>

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

// ------------------------------------------------------------------------------- residuals

Eigen::Vector4d SlidingWindow::residual(const Sighting& s, const SE3& T, const Chart& plane,
                                        const Eigen::Vector3d& anchor) {
  const Eigen::Vector3d n = T.so3().inverse() * plane.normal;
  const double rho = plane.rho - plane.normal.dot(T.translation() - anchor);
  Eigen::Vector4d r;
  r.head<3>() = s.A * n;
  r(3) = s.root_weight * (n.dot(s.mean) - rho);
  return r;
}

void SlidingWindow::jacobians(const Sighting& s, const SE3& T, const Chart& plane,
                              const Eigen::Vector3d& anchor, Eigen::Matrix<double, 4, 6>& J_pose,
                              Eigen::Matrix<double, 4, 3>& J_plane) {
  const Eigen::Matrix3d Rt = T.so3().matrix().transpose();
  const Eigen::Vector3d n = Rt * plane.normal;
  const Eigen::Matrix3d turn = SO3::hat(n);  // n(exp(w)) = n + hat(n) w
  J_pose.topLeftCorner<3, 3>().setZero();
  J_pose.topRightCorner<3, 3>() = s.A * turn;
  J_pose.bottomLeftCorner<1, 3>() = s.root_weight * n.transpose();
  J_pose.bottomRightCorner<1, 3>() = s.root_weight * (s.mean.transpose() * turn);
  const Matrix32d RtB = Rt * plane.basis;
  J_plane.topLeftCorner<3, 2>() = s.A * RtB;
  J_plane.topRightCorner<3, 1>().setZero();
  J_plane.bottomLeftCorner<1, 2>() =
      s.root_weight *
      (s.mean.transpose() * RtB + (T.translation() - anchor).transpose() * plane.basis);
  J_plane(3, 2) = -s.root_weight;
}

double SlidingWindow::robust_weight(double chi_squared) const {
  const double bound = options_.robust_chi_squared;
  return chi_squared <= bound ? 1.0 : std::sqrt(bound / chi_squared);
}

namespace {

double huber(double chi_squared, double weight) {
  return weight >= 1.0 ? chi_squared : chi_squared * weight * (2.0 - weight);
}

// Where each id stands in a list: many are asked for.
template <class States>
auto positions(const States& states) {
  using Id = decltype(states.front().id);
  std::vector<std::pair<Id, int>> sorted;
  for (const auto& state : states) sorted.emplace_back(state.id, static_cast<int>(sorted.size()));
  std::sort(sorted.begin(), sorted.end());
  return [sorted = std::move(sorted)](Id id) {
    return std::lower_bound(sorted.begin(), sorted.end(), std::pair(id, 0))->second;
  };
}

}  // namespace

double SlidingWindow::build(Build what) {
  if (what == Build::kGradient) {
    system_.reset_gradient();
  } else {
    system_.reset(static_cast<int>(poses_.size()), static_cast<int>(planes_.size()));
  }
  weight_change_ = 0;
  // Of a factor in the equations, given that of the present states.
  const auto used_weight = [&](double& stored, double now) {
    if (what == Build::kEquations) stored = now;
    weight_change_ = std::max(weight_change_, std::abs(now - stored));
    return what == Build::kFirst ? stored : now;
  };
  double cost = 0;
  const auto at = [](const auto& state) -> const auto& {
    return state.frozen ? state.first : state.now;
  };
  if (prior_.r.size() > 0) {
    const Eigen::VectorXd e = prior_.r + prior_.R * prior_step();
    cost += e.squaredNorm();
    system_.add_dense(prior_columns(), prior_.H, prior_.R.transpose() * e);
  }
  for (auto& f : betweens_) {
    int a = find(f.from), b = find(f.to);
    const Pose &pa = poses_[static_cast<std::size_t>(a)], &pb = poses_[static_cast<std::size_t>(b)];
    const Vector6d raw = (f.T.inverse() * pa.now.inverse() * pb.now).log();
    const Vector6d r = f.S * raw;
    const double chi = r.squaredNorm(), weight = f.robust ? robust_weight(chi) : 1.0;
    cost += huber(chi, weight);
    const double root = std::sqrt(used_weight(f.weight, weight));
    const Matrix6d Jb = root * f.S * SE3::right_jacobian_inverse(raw);
    const Matrix6d Ja = -Jb * (at(pb).inverse() * at(pa)).adjoint();
    if (a < b) {
      system_.add_pose_pose(a, b, Ja, Jb, root * r);
    } else {
      system_.add_pose_pose(b, a, Jb, Ja, root * r);
    }
  }
  for (const auto& f : singles_) {
    const int a = find(f.id);
    const Vector6d raw = (f.T.inverse() * poses_[static_cast<std::size_t>(a)].now).log();
    const Vector6d r = f.S * raw;
    cost += r.squaredNorm();
    system_.add_pose(a, f.S * SE3::right_jacobian_inverse(raw), r);
  }
  for (const auto& f : gravity_) {
    const int a = find(f.id);
    const Pose& pose = poses_[static_cast<std::size_t>(a)];
    const Eigen::Vector3d up = pose.now.so3() * f.up;
    const Eigen::Vector2d r = up.head<2>() / f.sigma;
    cost += r.squaredNorm();
    Eigen::Matrix<double, 2, 6> J = Eigen::Matrix<double, 2, 6>::Zero();
    J.rightCols<3>() = -(at(pose).so3().matrix() * SO3::hat(f.up)).topRows<2>() / f.sigma;
    system_.add_pose(a, J, r);
  }
  for (const auto& f : holds_) {
    const int a = find(f.id);
    const Eigen::Vector3d r = f.S * planes_[static_cast<std::size_t>(a)].now.boxminus(f.at);
    cost += r.squaredNorm();
    system_.add_plane(a, f.S, r);
  }
  Eigen::Matrix<double, 4, 6> J_pose;
  Eigen::Matrix<double, 4, 3> J_plane;
  const auto position = positions(planes_);
  int a = -1;
  for (auto& s : sightings_) {
    if (a < 0 || poses_[static_cast<std::size_t>(a)].id != s.keyframe) a = find(s.keyframe);
    const int b = position(s.plane);
    const Pose& pose = poses_[static_cast<std::size_t>(a)];
    const Landmark& plane = planes_[static_cast<std::size_t>(b)];
    const Eigen::Vector4d r = residual(s, pose.now, plane.now, plane.anchor);
    const double chi = r.squaredNorm(), weight = robust_weight(chi);
    cost += huber(chi, weight);
    jacobians(s, at(pose), at(plane), plane.anchor, J_pose, J_plane);
    const double root = std::sqrt(used_weight(s.weight, weight));
    system_.add_pose_plane(a, b, root * J_pose, root * J_plane, root * r);
  }
  return cost;
}

std::vector<int> SlidingWindow::prior_columns() const {
  std::vector<int> columns;
  const int border = 6 * static_cast<int>(poses_.size());
  for (const KeyframeId id : prior_.poses) {
    for (int k = 0; k < 6; ++k) columns.push_back(6 * find(id) + k);
  }
  for (const PlaneId id : prior_.planes) {
    for (int k = 0; k < 3; ++k) columns.push_back(border + 3 * find(id) + k);
  }
  return columns;
}

Eigen::VectorXd SlidingWindow::prior_step() const {
  Eigen::VectorXd d(prior_.R.cols());
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < prior_.poses.size(); ++i, row += 6) {
    const auto& now = poses_[static_cast<std::size_t>(find(prior_.poses[i]))].now;
    d.segment<6>(row) = (prior_.poses_at[i].inverse() * now).log();
  }
  for (std::size_t i = 0; i < prior_.planes.size(); ++i, row += 3) {
    const auto& now = planes_[static_cast<std::size_t>(find(prior_.planes[i]))].now;
    d.segment<3>(row) = now.boxminus(prior_.planes_at[i]);
  }
  return d;
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
