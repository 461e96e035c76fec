// Plane factors with errors: each a linear map of homogeneous points in the body's frame.
#include <lamina/backend/parameters/depth_errors.hpp>

#include <array>
#include <cmath>

#include <lamina/backend/parameters/common_mode_estimation.hpp>

namespace lamina {
namespace {

constexpr int kWheels = DepthErrors::kWheels, kLevel = DepthErrors::kLevel;
constexpr int kOfPlanes = DepthErrors::kLevel + DepthErrors::kCamera;
constexpr int kFocal = kOfPlanes - 1;
constexpr double kDelta = 1e-4;  // of an error, for differences

// Swells of a floor tilt and lift a body that is taken to stay level, as a longer lens would have
// it: walls alone tell the focal length.
bool is_ground(const Graph& graph, const PlaneMomentsFactor& f) {
  constexpr double kUpright = 0.9;  // cosine
  return std::abs(graph.at(f.plane).plane_map().normal().z()) > kUpright;
}

// Points, corrected, are (I + sum of errors times these) times measured ones.
using Generators = std::array<Eigen::Matrix4d, kOfPlanes>;

Generators generators_of(const SE3& T_body_camera) {
  Generators all;
  all.fill(Eigen::Matrix4d::Zero());
  for (int axis = 0; axis < 2; ++axis) {
    Eigen::Matrix4d& turn = all[static_cast<std::size_t>(axis)];
    const Eigen::Matrix3d about = SO3::hat(Eigen::Vector3d::Unit(axis));
    turn.topLeftCorner<3, 3>() = about;
    turn.topRightCorner<3, 1>() = -about * T_body_camera.translation();
  }
  all[2](2, 3) = 1;
  const Eigen::Matrix4d T = T_body_camera.matrix(), T_inverse = T_body_camera.inverse().matrix();
  for (int k = 0; k < DepthErrors::kCamera; ++k) {
    Eigen::Matrix4d of_camera = Eigen::Matrix4d::Zero();
    if (k < 3) {
      of_camera(3, k) = -1;
    } else {
      of_camera(0, 0) = of_camera(1, 1) = 1;
    }
    all[static_cast<std::size_t>(kLevel + k)] = T * of_camera * T_inverse;
  }
  return all;
}

Graph with_errors(const Graph& graph, const Generators& generators, const Eigen::VectorXd& errors) {
  Graph changed = graph;
  const WheelErrors::Vector of_wheels = errors.head<kWheels>();
  for (OdometryFactor& f : changed.odometry) f.T_from_to = corrected(f.T_from_to, of_wheels);
  if (errors.tail<kOfPlanes>().isZero(0)) return changed;
  Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
  for (int k = 0; k < kOfPlanes; ++k)
    A += errors(kWheels + k) * generators[static_cast<std::size_t>(k)];
  const Eigen::Matrix4d of_ground =
      A - errors(kWheels + kFocal) * generators[static_cast<std::size_t>(kFocal)];
  for (PlaneMomentsFactor& f : changed.plane_moments) {
    const Eigen::Matrix4d& B = is_ground(graph, f) ? of_ground : A;
    const auto moments = Moments::from_homogeneous(B * f.moments_body.homogeneous() * B.transpose(),
                                                   f.moments_body.count());
    if (moments) f.moments_body = *moments;
  }
  return changed;
}

}  // namespace

std::optional<DepthErrors> estimate_depth_errors(const Graph& graph, const SE3& T_body_camera,
                                                 const DepthErrors::Matrix& prior_information,
                                                 const DepthErrors::Vector& already) {
  if (graph.odometry.empty() || graph.plane_moments.empty()) return std::nullopt;
  const Generators generators = generators_of(T_body_camera);
  SharedErrorModel model;
  model.corrected = [&generators](const Graph& of, const Eigen::VectorXd& e) {
    return with_errors(of, generators, e);
  };
  model.delta = kDelta;
  model.C = prior_information;
  model.g = prior_information * already;
  const WheelTerms of_wheels = wheel_terms(graph);
  model.C.topLeftCorner<kWheels, kWheels>() += of_wheels.C;
  model.g.head<kWheels>() += of_wheels.g;
  // p^T M p of the plane p = (n, -rho) in the body's frame; errors change p by generator^T p.
  for (const PlaneMomentsFactor& f : graph.plane_moments) {
    const Plane plane_body =
        graph.at(f.keyframe).T_map_body.inverse() * graph.at(f.plane).plane_map();
    const Eigen::Vector4d p(plane_body.normal().x(), plane_body.normal().y(),
                            plane_body.normal().z(), -plane_body.rho());
    Eigen::Matrix<double, 4, kOfPlanes> j;
    for (int k = 0; k < kOfPlanes; ++k)
      j.col(k) = generators[static_cast<std::size_t>(k)].transpose() * p;
    if (is_ground(graph, f)) j.col(kFocal).setZero();
    const Eigen::Matrix4d M = f.weight * f.moments_body.homogeneous();
    model.C.bottomRightCorner<kOfPlanes, kOfPlanes>() += j.transpose() * M * j;
    model.g.tail<kOfPlanes>() += j.transpose() * M * p;
  }
  const auto found = estimate_shared_errors(graph, model);
  if (!found) return std::nullopt;
  return DepthErrors{found->value, found->covariance};
}

}  // namespace lamina
