// The fixed-lag estimator: the newest keyframes and the planes they see, everything older as one
// marginal prior in square-root form with first-estimate Jacobians.
// An engine (window_engine.hpp) moves the states; adding, leaving and covariances are here.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <lamina/backend/solver/window/dormant_states.hpp>
#include <lamina/backend/solver/window/marginalization.hpp>
#include <lamina/backend/solver/window/window_engine.hpp>

namespace lamina {

/// What left the window: final fixed-lag estimates.
struct WindowDepartures {
  struct Pose {
    KeyframeId id = KeyframeId::kNone;
    SE3 T_map_body;
  };
  struct Landmark {
    PlaneId id = PlaneId::kNone;
    Plane plane_anchor;
    Eigen::Matrix3d covariance;  ///< in plane_anchor's boxplus tangent
  };
  std::vector<Pose> poses;
  std::vector<Landmark> planes;
};

/// Of every state of a window by itself, as covariance() has them on its diagonal.
struct WindowCovariances {
  std::vector<Matrix6d> poses;          ///< as keyframes(), in their right tangents
  std::vector<Eigen::Matrix3d> planes;  ///< as planes(), in the tangents of plane_anchor()
  int held_directions = 0;  ///< no evidence at all in so many directions: no variance there either
};

class SlidingWindow {
 public:
  explicit SlidingWindow(const WindowOptions& options);

  // ---- evidence. Ids that are not in the window: the call returns false and nothing happens.

  /// The newest keyframe. Starts at the given estimate.
  void add_keyframe(KeyframeId id, Timestamp stamp, const SE3& T_map_body);
  /// A plane starts with no information of its own, or as it left: with all that tied it to the
  /// states that stayed (planes_behind) where estimate and anchor are those it left with, else with
  /// the covariance. True: as it left, priors and all.
  bool add_plane(PlaneId id, const Plane& plane_anchor, const Eigen::Vector3d& anchor_map,
                 const std::optional<Eigen::Matrix3d>& covariance = std::nullopt);
  /// Information on a plane's tilt (rad) and distance (m), as 1-sigma about a plane known from
  /// elsewhere (map axes, origin at the landmark's anchor): holds directions that no measurement
  /// sees.
  bool add_prior(PlaneId id, const Plane& plane_anchor, double sigma_tilt, double sigma_rho);
  bool add(const PriorFactor& factor);
  bool add(const OdometryFactor& factor);
  bool add(const LoopFactor& factor);
  bool add(const PlaneMomentsFactor& factor);
  bool add(const GravityFactor& factor);
  /// Of keyframes of the window alone; others are the refiner's.
  bool add(const CustomFactor& factor);
  /// Replaces the evidence of one keyframe on one plane (it grew), or adds it.
  bool set(const PlaneMomentsFactor& factor);
  /// A cell of a floor that is no plane, at T_map_cell (z up), tied to its parent. Ids rise. It
  /// stays until the first keyframe that saw it leaves.
  bool add_surfel(SurfelId id, const SE3& T_map_cell, const SurfelParentFactor& parent);
  /// Replaces what one keyframe saw of a surfel, or adds it.
  bool set(const SurfelMomentsFactor& factor);
  /// Gives the observations of `from` in the window to `into`, which must be in it.
  bool merge_planes(PlaneId from, PlaneId into);

  /// The plane goes by another id from now on (it was recognised). False when `from` is not in the
  /// window or `into` is.
  bool rename_plane(PlaneId from, PlaneId into);
  /// The same plane about another anchor; the prior's columns follow exactly.
  bool set_anchor(PlaneId id, const Eigen::Vector3d& anchor_map);

  // ---- estimation

  WindowReport solve();
  /// Takes out keyframes and planes beyond the lag, oldest first, leaving a prior.
  WindowDepartures marginalize();
  /// Moves the whole window, its prior with it: T_new_old maps old map coordinates to new ones.
  void move(const SE3& T_new_old);

  // ---- estimates

  bool contains(KeyframeId id) const { return find(id) >= 0; }
  bool contains(PlaneId id) const { return find(id) >= 0; }
  bool contains(SurfelId id) const { return state_.find(id) >= 0; }
  std::size_t surfel_count() const { return state_.surfels.size(); }
  std::size_t keyframe_count() const { return state_.poses.size(); }
  std::size_t plane_count() const { return state_.planes.size(); }
  SE3 pose(KeyframeId id) const;
  Plane plane_anchor(PlaneId id) const;
  std::vector<KeyframeId> keyframes() const;
  std::vector<PlaneId> planes() const;
  /// Of the newest keyframe's pose in its right tangent, at the last solve().
  Matrix6d newest_covariance() const;
  /// Of the newest pose (6) and one plane (3), joint, at the last solve(). nullopt: not solved yet
  /// with that plane in it.
  std::optional<Eigen::Matrix<double, 9, 9>> joint_covariance(PlaneId id) const;
  /// The same for several planes at a cost of one solution for the pose and a small one a plane;
  /// planes that are not in the window are left out.
  std::vector<std::pair<PlaneId, Eigen::Matrix<double, 9, 9>>> joint_covariances(
      const std::vector<PlaneId>& ids) const;
  /// Of every state by itself, at the last solve(): a small part of what covariance() costs.
  WindowCovariances covariances() const;
  /// Of every state of the window, poses then planes (tangents of pose() and plane_anchor()).
  Eigen::MatrixXd covariance() const;
  /// What marginalised states left behind, in the graph's terms.
  MarginalPrior prior() const;

 private:
  // Copies with the window.
  struct ClonedEngine {
    explicit ClonedEngine(std::unique_ptr<WindowEngine> engine) : one(std::move(engine)) {}
    ClonedEngine(const ClonedEngine& other) : one(other.one->clone()) {}
    ClonedEngine(ClonedEngine&&) = default;
    ClonedEngine& operator=(ClonedEngine other) {
      one = std::move(other.one);
      return *this;
    }
    std::unique_ptr<WindowEngine> one;
  };

  int find(KeyframeId id) const { return state_.find(id); }
  int find(PlaneId id) const { return state_.find(id); }
  /// remember: planes that go may come back.
  void eliminate(const std::vector<bool>& pose_gone, const std::vector<bool>& plane_gone,
                 bool remember);
  std::vector<bool> planes_to_leave(int poses_gone) const;
  bool take_back(PlaneId id, const Plane& plane_anchor, const Eigen::Vector3d& anchor_map);
  void leave_behind(const EliminationOrder& order, const SquareRootInformation& left,
                    const std::vector<bool>& plane_gone, bool remember);
  void forget(PlaneId id);
  void remove_behind(std::ptrdiff_t at);
  Eigen::Matrix3d plane_covariance(int plane) const;

  WindowOptions options_;
  window::State state_;
  std::vector<window::Landmark> behind_;  // planes that left, as they were then
  StatesBehind states_behind_;            // their steps from there, given the prior's states
  ClonedEngine engine_;
  WindowSystem system_;
  bool solved_ = false;  // system_ holds a factor for the present states
  std::int64_t keyframes_added_ = 0;
};

}  // namespace lamina
