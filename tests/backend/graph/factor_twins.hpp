// The factors once more, as plain formulas for automatic differentiation: what the analytic
// Jacobians are compared with, in tests and in the benchmark.
#pragma once

#include <ceres/autodiff_cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include <lamina/backend/graph/graph.hpp>

namespace lamina::twins {

template <class T>
using Vec3 = Eigen::Matrix<T, 3, 1>;

template <class T>
struct Pose {
  Eigen::Quaternion<T> q;
  Vec3<T> t;
  explicit Pose(const T* x) : q(x[6], x[3], x[4], x[5]), t(x[0], x[1], x[2]) { q.normalize(); }
  explicit Pose(const SE3& pose)
      : q(pose.so3().quaternion().cast<T>()), t(pose.translation().cast<T>()) {}
  Pose(const Eigen::Quaternion<T>& rotation, const Vec3<T>& translation)
      : q(rotation), t(translation) {}
  Pose inverse() const { return Pose(q.conjugate(), -(q.conjugate() * t)); }
  Pose operator*(const Pose& o) const { return Pose(q * o.q, q * o.t + t); }
  Vec3<T> operator*(const Vec3<T>& x) const { return q * x + t; }
};

template <class T>
Vec3<T> rotation_log(Eigen::Quaternion<T> q) {
  if (q.w() < T(0)) q.coeffs() = -q.coeffs();
  const T n2 = q.vec().squaredNorm();
  if (n2 < T(1e-18)) return T(2) * q.vec() / q.w();
  using std::atan2;
  using std::sqrt;
  const T n = sqrt(n2);
  return (T(2) * atan2(n, q.w()) / n) * q.vec();
}

template <class T>
Eigen::Matrix<T, 6, 1> pose_log(const Pose<T>& pose) {
  const Vec3<T> w = rotation_log(pose.q);
  const T t2 = w.squaredNorm();
  T c = T(1.0 / 12.0);
  if (t2 > T(1e-8)) {
    using std::sqrt;
    using std::tan;
    const T t = sqrt(t2);
    c = (T(1) - T(0.5) * t / tan(T(0.5) * t)) / t2;
  }
  Eigen::Matrix<T, 6, 1> d;
  const Vec3<T> wt = w.cross(pose.t);
  d.template head<3>() = pose.t - T(0.5) * wt + c * w.cross(wt);
  d.template tail<3>() = w;
  return d;
}

template <class T>
Eigen::Matrix<T, 2, 1> sphere_log_twin(const Eigen::Vector3d& n0, const Vec3<T>& n) {
  const Eigen::Matrix<T, 2, 1> s = Plane::tangent_basis(n0).transpose().template cast<T>() * n;
  const T s2 = s.squaredNorm();
  if (s2 < T(1e-20)) return s;
  using std::atan2;
  using std::sqrt;
  const T sine = sqrt(s2);
  return (atan2(sine, n0.cast<T>().dot(n)) / sine) * s;
}

struct Odometry {
  OdometryFactor f;
  template <class T>
  bool operator()(const T* a, const T* b, T* r) const {
    const Pose<T> error = Pose<T>(f.T_from_to).inverse() * Pose<T>(a).inverse() * Pose<T>(b);
    Eigen::Map<Eigen::Matrix<T, 6, 1>> out(r);
    out = f.sqrt_information.cast<T>() * pose_log(error);
    return true;
  }
  static ceres::CostFunction* make(const OdometryFactor& f) {
    return new ceres::AutoDiffCostFunction<Odometry, 6, 7, 7>(new Odometry{f});
  }
};

struct PlanarOdometry {
  PlanarOdometryFactor f;
  template <class T>
  bool operator()(const T* a, const T* b, T* r) const {
    const auto d = pose_log(Pose<T>(f.T_from_to).inverse() * Pose<T>(a).inverse() * Pose<T>(b));
    Eigen::Map<Vec3<T>> out(r);
    out = f.sqrt_information.cast<T>() * Vec3<T>(d(0), d(1), d(5));
    return true;
  }
  static ceres::CostFunction* make(const PlanarOdometryFactor& f) {
    return new ceres::AutoDiffCostFunction<PlanarOdometry, 3, 7, 7>(new PlanarOdometry{f});
  }
};

struct Prior {
  PriorFactor f;
  template <class T>
  bool operator()(const T* a, T* r) const {
    Eigen::Map<Eigen::Matrix<T, 6, 1>> out(r);
    out = f.sqrt_information.cast<T>() * pose_log(Pose<T>(f.T_map_body).inverse() * Pose<T>(a));
    return true;
  }
  static ceres::CostFunction* make(const PriorFactor& f) {
    return new ceres::AutoDiffCostFunction<Prior, 6, 7>(new Prior{f});
  }
};

struct PlaneMoments {
  double root_weight;
  Eigen::Vector3d mean, anchor;
  Eigen::Matrix3d rows;
  template <class T>
  bool operator()(const T* pose_block, const T* plane, T* r) const {
    const Pose<T> pose(pose_block);
    const Vec3<T> n(plane[0], plane[1], plane[2]);
    const Vec3<T> x = pose * mean.cast<T>() - anchor.cast<T>();
    r[0] = root_weight * (n.dot(x) - plane[3]);
    Eigen::Map<Vec3<T>> tilt(r + 1);
    tilt = rows.cast<T>() * (pose.q.conjugate() * n);
    return true;
  }
};

// The block of a sensor's pose, from those of the body's and of the sensor in it.
template <class T>
std::array<T, 7> composed(const T* body, const T* sensor) {
  const Pose<T> pose = Pose<T>(body) * Pose<T>(sensor);
  return {pose.t.x(), pose.t.y(), pose.t.z(), pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()};
}

struct PlaneMomentsOfSensor {
  PlaneMoments of_sensor;
  template <class T>
  bool operator()(const T* pose, const T* plane, const T* sensor, T* r) const {
    return of_sensor(composed(pose, sensor).data(), plane, r);
  }
};

struct OdometryOfSensor {
  Odometry of_sensor;
  template <class T>
  bool operator()(const T* a, const T* b, const T* sensor, T* r) const {
    return of_sensor(composed(a, sensor).data(), composed(b, sensor).data(), r);
  }
};

struct Segment {
  SegmentFactor f;
  Eigen::Vector3d anchor;
  template <class T>
  bool operator()(const T* pose_block, const T* plane, T* r) const {
    const Pose<T> pose(pose_block);
    const Vec3<T> n(plane[0], plane[1], plane[2]);
    const Vec3<T> a = pose * f.start_body.cast<T>() - anchor.cast<T>();
    const Vec3<T> b = pose * f.end_body.cast<T>() - anchor.cast<T>();
    const T length = T((f.end_body - f.start_body).norm());
    const Eigen::Matrix<T, 2, 1> e(n.dot(b - a) / length, T(0.5) * n.dot(a + b) - plane[3]);
    Eigen::Map<Eigen::Matrix<T, 2, 1>> out(r);
    out = f.sqrt_information.cast<T>() * e;
    return true;
  }
};

struct Gravity {
  GravityFactor f;
  template <class T>
  bool operator()(const T* pose_block, T* r) const {
    const Vec3<T> up = Pose<T>(pose_block).q.conjugate() * Vec3<T>::UnitZ();
    Eigen::Map<Eigen::Matrix<T, 2, 1>> out(r);
    out = sphere_log_twin<T>(f.up_body, up) / T(f.sigma);
    return true;
  }
};

struct SurfelMoments {
  double root_weight;
  Eigen::Vector3d mean;
  Eigen::Matrix3d rows;
  SE3 T_body_cell;
  template <class T>
  bool operator()(const T* seen, const T* carrier, const T* s, T* r) const {
    const Pose<T> T_cell_k =
        Pose<T>(T_body_cell).inverse() * Pose<T>(carrier).inverse() * Pose<T>(seen);
    const Vec3<T> x = T_cell_k * mean.cast<T>();
    r[0] = root_weight * (x.z() - s[0] - s[1] * x.x() - s[2] * x.y());
    Eigen::Map<Vec3<T>> tilt(r + 1);
    tilt = rows.cast<T>() * (T_cell_k.q.conjugate() * Vec3<T>(-s[1], -s[2], T(1)));
    return true;
  }
};

struct SurfelMomentsOwn {
  SurfelMoments full;
  template <class T>
  bool operator()(const T* s, T* r) const {
    const T identity[7] = {T(0), T(0), T(0), T(0), T(0), T(0), T(1)};
    return full(identity, identity, s, r);
  }
};

struct SurfelParent {
  SurfelParentFactor f;
  SE3 T_body_cell;
  Eigen::Vector3d anchor;
  template <class T>
  bool operator()(const T* carrier, const T* plane, const T* s, T* r) const {
    const Pose<T> T_map_cell = Pose<T>(carrier) * Pose<T>(T_body_cell);
    const Vec3<T> n(plane[0], plane[1], plane[2]);
    const Vec3<T> x = T_map_cell * Vec3<T>(T(0), T(0), s[0]) - anchor.cast<T>();
    const Vec3<T> n_cell = T_map_cell.q.conjugate() * n;
    r[0] = (n.dot(x) - plane[3]) / T(f.sigma_height);
    r[1] = (n_cell.x() + s[1] * n_cell.z()) / T(f.sigma_slope);
    r[2] = (n_cell.y() + s[2] * n_cell.z()) / T(f.sigma_slope);
    return true;
  }
};

/// One pose and one plane.
struct Marginal {
  MarginalPrior f;
  template <class T>
  bool operator()(const T* pose, const T* plane, T* r) const {
    Eigen::Matrix<T, 9, 1> d;
    d.template head<6>() = pose_log(Pose<T>(f.poses_linear[0]).inverse() * Pose<T>(pose));
    d.template segment<2>(6) =
        sphere_log_twin<T>(f.planes_linear[0].normal(), Vec3<T>(plane[0], plane[1], plane[2]));
    d(8) = plane[3] - T(f.planes_linear[0].rho());
    Eigen::Map<Eigen::Matrix<T, 5, 1>> out(r);
    out = f.residual.cast<T>() + f.sqrt_information.cast<T>() * d;
    return true;
  }
};

}  // namespace lamina::twins
