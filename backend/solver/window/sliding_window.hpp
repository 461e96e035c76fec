// The fixed-lag estimator: the newest keyframes and the planes they see, everything older as one
// marginal prior in square-root form with first-estimate Jacobians.
//
// Gauss-Newton on normal equations of the window's own shape (window_system.hpp): a window is small
// and solved at every keyframe, where building a general problem costs more than solving it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/solver/window/dormant_states.hpp>
#include <lamina/backend/solver/window/marginalization.hpp>
#include <lamina/backend/solver/window/window_system.hpp>

namespace lamina {

struct WindowOptions {
  /// Keyframes kept as variables. More smooth longer, at a cost that grows linearly.
  int keyframes = 20;
  /// Time kept, s; 0: by number alone. At least three keyframes stay.
  double seconds = 0;
  /// A plane not seen by any keyframe of the window stays a variable for so many keyframes more:
  /// short occlusions must not cost what is known of it.
  int idle_keyframes = 20;
  /// Planes kept as variables at most; the longest unseen leave first. Bounds the time of a step.
  int max_planes = 80;
  /// Planes that left and are still known together with what stays, at most; the longest away are
  /// forgotten first. They cost their number squared at a keyframe, nothing at a step.
  int planes_behind = 80;
  int iterations = 3;  ///< Gauss-Newton steps at most per solve()
  /// Stop when the next step would lower chi-squared by less than this. A tenth of a unit is a
  /// third of a sigma in one direction.
  double stop_chi_squared = 0.02;
  /// Huber's bound on the chi-squared of one plane observation (3 degrees of freedom at 99.9 %).
  double robust_chi_squared = 16.3;
  /// A plane that comes back after it was forgotten is tied to its old estimate with its covariance
  /// times this. Planes that left together share the drift of their time, and return together:
  /// taken as independent they would count as many as they are. Covariance intersection with equal
  /// shares [Julier1997] divides by their number; 50 returning planes are a large room.
  double return_inflation = 50.0;

  /// One line for each setting that cannot be.
  std::vector<std::string> problems() const;
};

struct WindowReport {
  int iterations = 0;
  bool converged = false;   ///< the last step promised less than stop_chi_squared
  double chi_squared = 0;   ///< at the end, robust
  int residuals = 0;        ///< rows, marginal prior included
  int held_directions = 0;  ///< no evidence at all in so many directions: they did not move
  bool finite = true;       ///< false: a number was not finite; the estimate is as before
};

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
  /// Replaces the evidence of one keyframe on one plane (it grew), or adds it.
  bool set(const PlaneMomentsFactor& factor);
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
  std::size_t keyframe_count() const { return poses_.size(); }
  std::size_t plane_count() const { return planes_.size(); }
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
  // A unit normal with its own tangent basis: the basis is carried along, so that coordinates in it
  // do not jump where Plane::tangent_basis() does.
  struct Chart {
    Eigen::Vector3d normal;
    Matrix32d basis;
    double rho = 0;
    Chart boxplus(const Eigen::Vector3d& d) const;
    Eigen::Vector3d boxminus(const Chart& origin) const;
  };
  struct Pose {
    KeyframeId id;
    Timestamp stamp;
    SE3 now, first;       // first: where Jacobians are taken once frozen
    bool frozen = false;  // the marginal prior knows it
  };
  struct Landmark {
    PlaneId id;
    Eigen::Vector3d anchor;
    Chart now, first;
    bool frozen = false;
    KeyframeId last_seen = KeyframeId::kNone;
    std::int64_t idle_since = 0;  // count of keyframes added when it was last seen
  };
  struct Between {
    KeyframeId from, to;
    SE3 T;
    Matrix6d S;
    bool robust = false;
    double weight = 1;  // robust, in the equations at hand
  };
  struct Single {  // prior on a pose
    KeyframeId id;
    SE3 T;
    Matrix6d S;
  };
  struct Gravity {
    KeyframeId id;
    Eigen::Vector3d up;
    double sigma;
  };
  struct PlaneHold {  // prior on a plane, in the chart it was given in
    PlaneId id;
    Chart at;
    Eigen::Matrix3d S;
  };
  struct Sighting {
    KeyframeId keyframe;
    PlaneId plane;
    Eigen::Matrix3d A;  // square root of the scatter, by rows
    double root_weight;
    Eigen::Vector3d mean;
    // Robust, in the equations at hand. It begins with 1: before the first step a new keyframe is
    // where odometry put it, and good sightings look like outliers.
    double weight = 1;
  };
  struct Prior {
    std::vector<KeyframeId> poses;
    std::vector<SE3> poses_at;
    std::vector<PlaneId> planes;
    std::vector<Chart> planes_at;
    Eigen::MatrixXd R;
    Eigen::MatrixXd H;  // R^T R, made once
    Eigen::VectorXd r;
  };
  struct Linear;  // all factors at their linearisation point

  int find(KeyframeId id) const;
  int find(PlaneId id) const;
  static Sighting sighting(const PlaneMomentsFactor& factor);
  static Eigen::Vector4d residual(const Sighting& s, const SE3& T, const Chart& plane,
                                  const Eigen::Vector3d& anchor);
  static void jacobians(const Sighting& s, const SE3& T, const Chart& plane,
                        const Eigen::Vector3d& anchor, Eigen::Matrix<double, 4, 6>& J_pose,
                        Eigen::Matrix<double, 4, 3>& J_plane);
  double robust_weight(double chi_squared) const;
  // kFirst: equations with the weights from before; kEquations: with those of the present states;
  // kGradient: the gradient alone, with those too.
  enum class Build { kFirst, kEquations, kGradient };
  double build(Build what);
  double length(const Eigen::VectorXd& d) const;
  Eigen::VectorXd prior_step() const;
  std::vector<int> prior_columns() const;
  void apply(const Eigen::VectorXd& d);
  std::vector<LinearFactor> linearize_touching(const std::vector<bool>& pose_gone,
                                               const std::vector<bool>& plane_gone);
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
  std::vector<Pose> poses_;
  std::vector<Landmark> planes_;
  std::vector<Between> betweens_;
  std::vector<Single> singles_;
  std::vector<Gravity> gravity_;
  std::vector<PlaneHold> holds_;
  std::vector<Sighting> sightings_;
  Prior prior_;
  std::vector<Landmark> behind_;  // planes that left, as they were then
  StatesBehind states_behind_;    // their steps from there, given the prior's states
  WindowSystem system_;
  double weight_change_ = 0;  // at the last build(): the most, from those in the equations at hand
  bool solved_ = false;       // system_ holds a factor for the present states
  std::int64_t keyframes_added_ = 0;
};

}  // namespace lamina
