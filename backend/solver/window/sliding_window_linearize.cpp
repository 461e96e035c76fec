// The window's factors at their linearisation point: into the equations of a solve, or one by one
// for an elimination.
#include <lamina/backend/solver/window/sliding_window.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {

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

// First estimates: where the marginal prior holds a state, all Jacobians are taken at one point.
template <class State>
const auto& linearization_point(const State& state) {
  return state.frozen ? state.first : state.now;
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

// r = S log(T^-1 from^-1 to) with its Jacobians, all times the root of its robust weight.
struct RelativePoseTerm {
  Matrix6d J_from, J_to;
  Vector6d r;
};

template <class Factor, class Pose, class RootWeight>
RelativePoseTerm relative_pose_term(const Factor& f, const Pose& from, const Pose& to,
                                    const RootWeight& root_weight) {
  const Vector6d raw = (f.T.inverse() * from.now.inverse() * to.now).log();
  const Vector6d r = f.S * raw;
  const double root = root_weight(r.squaredNorm());
  RelativePoseTerm term;
  term.J_to = root * f.S * SE3::right_jacobian_inverse(raw);
  term.J_from =
      -term.J_to * (linearization_point(to).inverse() * linearization_point(from)).adjoint();
  term.r = root * r;
  return term;
}

// Of the map's vertical in the body, `up_body`, over sigma.
Eigen::Matrix<double, 2, 6> gravity_jacobian(const SO3& R_map_body, const Eigen::Vector3d& up_body,
                                             double sigma) {
  Eigen::Matrix<double, 2, 6> J = Eigen::Matrix<double, 2, 6>::Zero();
  J.rightCols<3>() = -(R_map_body.matrix() * SO3::hat(up_body)).topRows<2>() / sigma;
  return J;
}

}  // namespace

// All factors but the marginal prior. Where they go chooses which are taken, and gives the root of
// each robust weight.
struct SlidingWindow::Linear {
  struct Equations;
  struct Touching;

  template <class Sink>
  static void add_pose_factors(SlidingWindow& window, Sink& sink);
  template <class Sink>
  static void add_plane_factors(SlidingWindow& window, Sink& sink);
};

template <class Sink>
void SlidingWindow::Linear::add_pose_factors(SlidingWindow& window, Sink& sink) {
  const auto pose = [&](int a) -> const Pose& {
    return window.poses_[static_cast<std::size_t>(a)];
  };
  for (auto& f : window.betweens_) {
    const int a = window.find(f.from), b = window.find(f.to);
    if (!sink.takes_pose(a) && !sink.takes_pose(b)) continue;
    const auto term = relative_pose_term(f, pose(a), pose(b), [&](double chi) {
      return sink.root_weight(f.weight, chi, f.robust ? window.robust_weight(chi) : 1.0);
    });
    sink.add_pose_pose(a, b, term.J_from, term.J_to, term.r);
  }
  for (const auto& f : window.singles_) {
    const int a = window.find(f.id);
    if (!sink.takes_pose(a)) continue;
    const Vector6d raw = (f.T.inverse() * pose(a).now).log();
    const Vector6d r = f.S * raw;
    sink.add_pose(a, f.S * SE3::right_jacobian_inverse(raw), r);
  }
  for (const auto& f : window.gravity_) {
    const int a = window.find(f.id);
    if (!sink.takes_pose(a)) continue;
    const Eigen::Vector3d up = pose(a).now.so3() * f.up;
    const Eigen::Vector2d r = up.head<2>() / f.sigma;
    sink.add_pose(a, gravity_jacobian(linearization_point(pose(a)).so3(), f.up, f.sigma), r);
  }
}

template <class Sink>
void SlidingWindow::Linear::add_plane_factors(SlidingWindow& window, Sink& sink) {
  for (const auto& f : window.holds_) {
    const int a = window.find(f.id);
    if (!sink.takes_plane(a)) continue;
    sink.add_plane(a, f.S, f.S * window.planes_[static_cast<std::size_t>(a)].now.boxminus(f.at));
  }
  Eigen::Matrix<double, 4, 6> J_pose;
  Eigen::Matrix<double, 4, 3> J_plane;
  const auto position = positions(window.planes_);
  int a = -1;
  for (auto& s : window.sightings_) {
    if (a < 0 || window.poses_[static_cast<std::size_t>(a)].id != s.keyframe) {
      a = window.find(s.keyframe);
    }
    const int b = position(s.plane);
    if (!sink.takes_pose(a) && !sink.takes_plane(b)) continue;
    const Pose& pose = window.poses_[static_cast<std::size_t>(a)];
    const Landmark& plane = window.planes_[static_cast<std::size_t>(b)];
    const Eigen::Vector4d r = residual(s, pose.now, plane.now, plane.anchor);
    const double chi = r.squaredNorm();
    const double root = sink.root_weight(s.weight, chi, window.robust_weight(chi));
    jacobians(s, linearization_point(pose), linearization_point(plane), plane.anchor, J_pose,
              J_plane);
    sink.add_pose_plane(a, b, root * J_pose, root * J_plane, root * r);
  }
}

struct SlidingWindow::Linear::Equations {
  WindowSystem& system;
  Build what;
  double &cost, &weight_change;

  bool takes_pose(int /*pose*/) const { return true; }
  bool takes_plane(int /*plane*/) const { return true; }
  // Of a factor's robust weight in the equations, given that of the present states.
  double root_weight(double& stored, double chi, double weight) {
    cost += huber(chi, weight);
    if (what == Build::kEquations) stored = weight;
    weight_change = std::max(weight_change, std::abs(weight - stored));
    return std::sqrt(what == Build::kFirst ? stored : weight);
  }
  void add_pose_pose(int a, int b, const Matrix6d& Ja, const Matrix6d& Jb, const Vector6d& r) {
    if (a < b) {
      system.add_pose_pose(a, b, Ja, Jb, r);
    } else {
      system.add_pose_pose(b, a, Jb, Ja, r);
    }
  }
  template <class Jacobian, class Residual>
  void add_pose(int pose, const Jacobian& J, const Residual& r) {
    cost += r.squaredNorm();
    system.add_pose(pose, J, r);
  }
  void add_plane(int plane, const Eigen::Matrix3d& J, const Eigen::Vector3d& r) {
    cost += r.squaredNorm();
    system.add_plane(plane, J, r);
  }
  void add_pose_plane(int pose, int plane, const Eigen::Matrix<double, 4, 6>& J_pose,
                      const Eigen::Matrix<double, 4, 3>& J_plane, const Eigen::Vector4d& r) {
    system.add_pose_plane(pose, plane, J_pose, J_plane, r);
  }
};

double SlidingWindow::build(Build what) {
  if (what == Build::kGradient) {
    system_.reset_gradient();
  } else {
    system_.reset(static_cast<int>(poses_.size()), static_cast<int>(planes_.size()));
  }
  weight_change_ = 0;
  double cost = 0;
  if (prior_.r.size() > 0) {
    const Eigen::VectorXd e = prior_.r + prior_.R * prior_step();
    cost += e.squaredNorm();
    system_.add_dense(prior_columns(), prior_.H, prior_.R.transpose() * e);
  }
  Linear::Equations equations{system_, what, cost, weight_change_};
  Linear::add_pose_factors(*this, equations);
  Linear::add_plane_factors(*this, equations);
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

// Factors of states that go, each by itself; planes are numbered after all poses.
struct SlidingWindow::Linear::Touching {
  const std::vector<bool>&pose_gone, &plane_gone;
  std::vector<LinearFactor>& factors;

  bool takes_pose(int pose) const { return pose_gone[static_cast<std::size_t>(pose)]; }
  bool takes_plane(int plane) const { return plane_gone[static_cast<std::size_t>(plane)]; }
  double root_weight(double /*stored*/, double /*chi*/, double weight) const {
    return std::sqrt(weight);
  }
  int variable(int plane) const { return static_cast<int>(pose_gone.size()) + plane; }
  void add_pose_pose(int a, int b, const Matrix6d& Ja, const Matrix6d& Jb, const Vector6d& r) {
    factors.push_back({{a, b}, {Ja, Jb}, r});
  }
  void add_pose(int pose, const Eigen::MatrixXd& J, const Eigen::VectorXd& r) {
    factors.push_back({{pose}, {J}, r});
  }
  void add_plane(int plane, const Eigen::Matrix3d& J, const Eigen::Vector3d& r) {
    factors.push_back({{variable(plane)}, {J}, r});
  }
  void add_pose_plane(int pose, int plane, const Eigen::Matrix<double, 4, 6>& J_pose,
                      const Eigen::Matrix<double, 4, 3>& J_plane, const Eigen::Vector4d& r) {
    factors.push_back({{pose, variable(plane)}, {J_pose, J_plane}, r});
  }
};

std::vector<LinearFactor> SlidingWindow::linearize_touching(const std::vector<bool>& pose_gone,
                                                            const std::vector<bool>& plane_gone) {
  std::vector<LinearFactor> factors;
  if (prior_.r.size() > 0) {
    LinearFactor f;
    Eigen::Index column = 0;
    for (const KeyframeId id : prior_.poses) {
      f.variables.push_back(find(id));
      f.jacobians.push_back(prior_.R.middleCols(column, 6));
      column += 6;
    }
    for (const PlaneId id : prior_.planes) {
      f.variables.push_back(static_cast<int>(poses_.size()) + find(id));
      f.jacobians.push_back(prior_.R.middleCols(column, 3));
      column += 3;
    }
    f.residual = prior_.r + prior_.R * prior_step();
    factors.push_back(std::move(f));
  }
  Linear::Touching touching{pose_gone, plane_gone, factors};
  Linear::add_pose_factors(*this, touching);
  Linear::add_plane_factors(*this, touching);
  return factors;
}

}  // namespace lamina
