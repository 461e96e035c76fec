// What a sliding window holds: states, evidence, and the prior of what left. A value, without a
// solver.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <lamina/backend/graph/custom_factor.hpp>
#include <lamina/backend/graph/factors/gravity.hpp>
#include <lamina/backend/graph/factors/odometry.hpp>
#include <lamina/backend/graph/factors/plane_moments.hpp>
#include <lamina/backend/graph/factors/prior.hpp>
#include <lamina/backend/graph/factors/surfel_moments.hpp>
#include <lamina/backend/graph/factors/surfel_parent.hpp>

namespace lamina::window {

struct Pose {
  KeyframeId id;
  Timestamp stamp;
  PoseState now, first;  ///< first: where Jacobians are taken once frozen
  bool frozen = false;   ///< the marginal prior has it
};

struct Landmark {
  PlaneId id;
  Eigen::Vector3d anchor;
  PlaneState now, first;  ///< bases are carried along
  bool frozen = false;
  KeyframeId last_seen = KeyframeId::kNone;
  std::int64_t idle_since = 0;  ///< count of keyframes added when it was last seen
};

/// A factor's `serial` is its own as long as it stays as it is.
struct RelativePose {
  std::uint64_t serial;
  KeyframeId from, to;
  OdometryTerm term;
  bool robust = false;
  double weight = 1;  ///< robust, in the equations at hand
};

struct PosePrior {
  std::uint64_t serial;
  KeyframeId id;
  PriorTerm term;
};

struct Gravity {
  std::uint64_t serial;
  KeyframeId id;
  GravityTerm term;
};

struct PlanePrior {
  std::uint64_t serial;
  PlaneId id;
  PlaneState at;  ///< in the tangent it was given in
  Eigen::Matrix3d S;
};

struct PlaneView {
  std::uint64_t serial;
  KeyframeId keyframe;
  PlaneId plane;
  PlaneMomentsTerm term;  ///< about the plane's anchor
  /// Robust, in the equations at hand. It begins with 1: before the first step a new keyframe is
  /// where odometry put it, and good views look like outliers.
  double weight = 1;
};

/// What one keyframe saw of a surfel.
struct SurfelView {
  std::uint64_t serial;
  KeyframeId keyframe;
  SurfelMomentsTerm term;  ///< carried by the map
};

/// A cell of a floor that is no plane, at a fixed place in the map. It leaves with the first
/// keyframe that saw it: poses and planes alone are in the prior.
struct Surfel {
  std::uint64_t serial;  ///< of its tie to the parent
  SurfelId id;
  FlatState now;
  PlaneId parent;
  SurfelParentTerm tie;  ///< carried by the map, about the parent's anchor
  std::vector<SurfelView> views;
};

/// A user's factor of keyframes alone.
struct Custom {
  std::uint64_t serial;
  std::vector<KeyframeId> keyframes;
  CustomFactor factor;
};

/// What marginalised states left behind: |r + R d|^2, d the steps from poses_at and planes_at.
struct Prior {
  std::uint64_t serial = 0;
  std::vector<KeyframeId> poses;
  std::vector<SE3> poses_at;
  std::vector<PlaneId> planes;
  std::vector<PlaneState> planes_at;
  Eigen::MatrixXd R;
  Eigen::MatrixXd H;  ///< R^T R, made once
  Eigen::VectorXd r;
};

struct State {
  std::vector<Pose> poses;  ///< in time order
  std::vector<Landmark> planes;
  std::vector<RelativePose> relative_poses;
  std::vector<PosePrior> pose_priors;
  std::vector<Gravity> gravity;
  std::vector<PlanePrior> plane_priors;
  std::vector<PlaneView> views;
  std::vector<Surfel> surfels;  ///< by their ids
  std::vector<Custom> custom;
  Prior prior;
  std::uint64_t last_serial = 0;

  std::uint64_t next_serial() { return ++last_serial; }
  /// All factors as new: what they refer to has changed.
  void renew_serials();
  /// Place in the list; -1: not there.
  int find(KeyframeId id) const;
  int find(PlaneId id) const;
  int find(SurfelId id) const;
  int residuals() const;
  /// Whether a surfel goes with states, marked by their places.
  bool goes(const Surfel& surfel, const std::vector<bool>& pose_gone,
            const std::vector<bool>& plane_gone) const;
  /// Takes out states, marked by their places, and all factors that touch them; the prior stays.
  void erase(const std::vector<bool>& pose_gone, const std::vector<bool>& plane_gone);
  /// Steps of the prior's states from where it was linearised.
  Eigen::VectorXd prior_step() const;
};

}  // namespace lamina::window
