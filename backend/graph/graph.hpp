// Keyframes, plane landmarks, floor surfels and the factors between them. Plain values: stored
// once, read by the sliding window and the refiner alike.
//
// Frames: map, body (keyframe), sensor; see models/frames.hpp. Perturbations: poses T * exp(d), d =
// (translation, rotation); planes Plane::boxplus about the landmark's own anchor.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lamina/backend/graph/custom_factor.hpp>
#include <lamina/backend/graph/ids.hpp>
#include <lamina/models/lie/se3.hpp>
#include <lamina/models/moments.hpp>
#include <lamina/models/plane.hpp>
#include <lamina/models/polygon.hpp>
#include <lamina/models/scan_segment.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

// ---------------------------------------------------------------------------------- states

struct Keyframe {
  KeyframeId id = KeyframeId::kNone;
  Timestamp stamp;
  SE3 T_map_body;
  bool fixed = false;  ///< held by every solver (the first keyframe: it defines the map frame)
};

/// How often a front-end called a plane what. Votes, decided when the map is made.
struct LabelVotes {
  double floor = 0, sub_dominant = 0, obstacle = 0;
};

/// A plane of the map. Its distance is taken at `anchor_map`, a point on or near it, so that rho
/// and tilt stay uncoupled however far the map's origin is.
struct PlaneLandmark {
  PlaneId id = PlaneId::kNone;
  Eigen::Vector3d anchor_map = Eigen::Vector3d::Zero();  ///< fixed while the plane lives
  Plane plane_anchor;  ///< map axes, origin at the anchor: n.(x - anchor) = rho
  /// Of plane_anchor in its boxplus tangent (tilt, tilt, rho), rad^2 and m^2; empty: not computed.
  std::optional<Eigen::Matrix3d> covariance;
  /// Frame of the outline: origin at the anchor's projection, z along the normal. Carried along by
  /// set_plane() with the least rotation, so that cells stay where they were seen.
  SE3 T_map_outline;
  OutlineGrid outline;
  std::int64_t observations = 0;
  Timestamp first_seen, last_seen;
  LabelVotes votes;
  bool active = true;                    ///< false: merged away, or dropped for want of evidence
  PlaneId merged_into = PlaneId::kNone;  ///< set when another landmark took its evidence
  bool fixed = false;                    ///< held by every solver

  /// A landmark for `plane_map` anchored at the projection of `near_map` onto it.
  static PlaneLandmark at(const Plane& plane_map, const Eigen::Vector3d& near_map);
  Plane plane_map() const;
  /// Moves the plane (same anchor) and its outline's frame with it.
  void set_plane_anchor(const Plane& plane_anchor_new);
};

/// A cell of floor carried by a keyframe: refinement of the poses moves it free of charge.
/// In the cell's frame (z up): z = height + slope.x x + slope.y y.
struct SurfelLandmark {
  SurfelId id = SurfelId::kNone;
  KeyframeId anchor = KeyframeId::kNone;
  SE3 T_body_cell;                                  ///< of the anchor keyframe; constant
  double radius = 0;                                ///< m
  Eigen::Vector3d state = Eigen::Vector3d::Zero();  ///< height (m), slope.x, slope.y
  std::optional<Eigen::Matrix3d> covariance;        ///< of state
  PlaneId parent = PlaneId::kNone;
};

/// Where a sensor sits. Factors hold what it measured in body axes as `T_body_sensor` has it: with
/// the sensor at `state`, a point x_body of theirs lies at state T_body_sensor^-1 x_body.
/// Perturbation: state * exp(d), d = (translation, rotation) in sensor axes.
struct Extrinsics {
  ExtrinsicsId id = ExtrinsicsId::kNone;
  std::string sensor;  ///< as calibration.yaml calls it
  SE3 T_body_sensor;   ///< by which factors were made
  SE3 state;           ///< T_body_sensor as estimated
  SE3 prior;           ///< T_body_sensor as stated
  Vector6d prior_sigma = (Vector6d() << 0.03, 0.03, 0.03, 0.026, 0.026, 0.026)
                             .finished();  ///< of log(prior^-1 state), m and rad
  bool estimate = false;                   ///< false: held at `state`

  /// A sensor that sits as stated, factors made so.
  static Extrinsics at(std::string sensor, const SE3& T_body_sensor);
  /// Factors stand as they were made.
  bool held_as_made() const;
};

// ---------------------------------------------------------------------------------- factors
// `sqrt_information` S whitens: |S r|^2 is a chi-squared. `weight` in [0, 1] is what the last
// refinement made of a factor it may doubt; 0: rejected. Residuals: factors/*.hpp.

/// log(T_from_to^-1 * T_from^-1 * T_to), 6.
struct OdometryFactor {
  KeyframeId from = KeyframeId::kNone, to = KeyframeId::kNone;
  SE3 T_from_to;
  Matrix6d sqrt_information = Matrix6d::Identity();
  ExtrinsicsId extrinsics = ExtrinsicsId::kNone;  ///< the sensor whose own motion was measured
};

/// As odometry, but x, y and heading alone: wheels on a floor know no more.
struct PlanarOdometryFactor {
  KeyframeId from = KeyframeId::kNone, to = KeyframeId::kNone;
  SE3 T_from_to;
  Eigen::Matrix3d sqrt_information = Eigen::Matrix3d::Identity();  ///< of (x, y, yaw)
};

/// A pose-to-pose loop: as odometry, but it may be wrong.
struct LoopFactor {
  KeyframeId from = KeyframeId::kNone, to = KeyframeId::kNone;
  SE3 T_from_to;
  Matrix6d sqrt_information = Matrix6d::Identity();
  double weight = 1;
  ExtrinsicsId extrinsics = ExtrinsicsId::kNone;  ///< as of odometry
};

/// log(T_map_body_prior^-1 * T_map_body), 6.
struct PriorFactor {
  KeyframeId keyframe = KeyframeId::kNone;
  SE3 T_map_body;
  Matrix6d sqrt_information = Matrix6d::Identity();
};

/// What one sensor saw of a plane; kNone: nobody knows which did, it is held as it was made.
struct SensorMoments {
  ExtrinsicsId extrinsics = ExtrinsicsId::kNone;
  Moments moments_body;
};

/// A plane seen from a keyframe, fully or in part. `moments_body` are discounted() already.
struct PlaneMomentsFactor {
  KeyframeId keyframe = KeyframeId::kNone;
  PlaneId plane = PlaneId::kNone;
  Moments moments_body;  ///< by Extrinsics::T_body_sensor, weights 1/sigma^2 (1/m^2)
  ExtrinsicsId extrinsics = ExtrinsicsId::kNone;  ///< the sensor; as SensorMoments has it
  double weight = 1;
  std::vector<SensorMoments> by_sensor = {};  ///< where several saw it: moments_body is their sum
};

/// A scan segment in the document's terms: rotation between the segment and its projection onto
/// the plane, and the mean distance of its end points.
struct SegmentFactor {
  KeyframeId keyframe = KeyframeId::kNone;
  PlaneId plane = PlaneId::kNone;
  Eigen::Vector3d start_body = Eigen::Vector3d::Zero();
  Eigen::Vector3d end_body = Eigen::Vector3d::Zero();
  Eigen::Matrix2d sqrt_information = Eigen::Matrix2d::Identity();  ///< of (rad, m)
  double weight = 1;
};

/// Direction of "up" as an accelerometer at rest sees it.
struct GravityFactor {
  KeyframeId keyframe = KeyframeId::kNone;
  Eigen::Vector3d up_body = Eigen::Vector3d::UnitZ();  ///< unit
  double sigma = 0.02;                                 ///< rad, about each horizontal axis
};

/// Floor points of one keyframe that fell into one surfel's cell.
struct SurfelMomentsFactor {
  KeyframeId keyframe = KeyframeId::kNone;
  SurfelId surfel = SurfelId::kNone;
  Moments moments_body;  ///< discounted(), weights 1/sigma^2 (1/m^2)
};

/// A surfel lies on its parent plane, but may step out of it: robust.
struct SurfelParentFactor {
  SurfelId surfel = SurfelId::kNone;
  PlaneId plane = PlaneId::kNone;
  double sigma_height = 0.01;  ///< m
  double sigma_slope = 0.05;   ///< m per m
};

/// What marginalised states left behind: |residual + sqrt_information * d|^2, d the stacked
/// boxminus of the states from where they were linearised, in the order keyframes, planes,
/// surfels. Rows need not be as many as columns.
struct MarginalPrior {
  std::vector<KeyframeId> keyframes;
  std::vector<SE3> poses_linear;  ///< T_map_body
  std::vector<PlaneId> planes;
  std::vector<Plane> planes_linear;  ///< about their anchors
  std::vector<SurfelId> surfels;
  std::vector<Eigen::Vector3d> surfels_linear;
  Eigen::MatrixXd sqrt_information;
  Eigen::VectorXd residual;

  Eigen::Index dimension() const {
    return static_cast<Eigen::Index>(6 * keyframes.size() + 3 * planes.size() + 3 * surfels.size());
  }
};

enum class FactorType {
  kOdometry,
  kPlanarOdometry,
  kLoop,
  kPrior,
  kPlaneMoments,
  kSegment,
  kGravity,
  kSurfelMoments,
  kSurfelParent,
  kMarginalPrior,
  kCustom
};
inline constexpr int kFactorTypes = 11;
const char* to_string(FactorType type);

/// A factor by its place in the Graph's vector of its type.
struct FactorRef {
  FactorType type = FactorType::kOdometry;
  std::size_t index = 0;
  auto operator<=>(const FactorRef&) const = default;
};

// ---------------------------------------------------------------------------------- graph

/// All states and factors, in the order they were added. Vectors of states are sorted by id (ids
/// rise), so find_* is a binary search. Pointers stay valid until the next add or remove.
struct Graph {
  std::vector<Keyframe> keyframes;
  std::vector<PlaneLandmark> planes;
  std::vector<SurfelLandmark> surfels;
  std::vector<Extrinsics> extrinsics;
  std::vector<CustomState> custom_states;

  std::vector<OdometryFactor> odometry;
  std::vector<PlanarOdometryFactor> planar_odometry;
  std::vector<LoopFactor> loops;
  std::vector<PriorFactor> priors;
  std::vector<PlaneMomentsFactor> plane_moments;
  std::vector<SegmentFactor> segments;
  std::vector<GravityFactor> gravity;
  std::vector<SurfelMomentsFactor> surfel_moments;
  std::vector<SurfelParentFactor> surfel_parents;
  std::vector<MarginalPrior> marginal_priors;
  std::vector<CustomFactor> custom;

  /// The ids the next add_* gives.
  std::int64_t next_keyframe = 0, next_plane = 0, next_surfel = 0, next_extrinsics = 0;
  std::int64_t next_custom_state = 0;

  KeyframeId add_keyframe(Timestamp stamp, const SE3& T_map_body);
  PlaneId add_plane(PlaneLandmark plane);
  SurfelId add_surfel(SurfelLandmark surfel);
  ExtrinsicsId add_extrinsics(Extrinsics sensor);
  CustomStateId add_custom_state(CustomState state);

  Keyframe* find(KeyframeId id);
  const Keyframe* find(KeyframeId id) const;
  PlaneLandmark* find(PlaneId id);
  const PlaneLandmark* find(PlaneId id) const;
  SurfelLandmark* find(SurfelId id);
  const SurfelLandmark* find(SurfelId id) const;
  Extrinsics* find(ExtrinsicsId id);
  const Extrinsics* find(ExtrinsicsId id) const;
  CustomState* find(CustomStateId id);
  const CustomState* find(CustomStateId id) const;

  /// As find, but a missing id is a broken promise (std::logic_error).
  template <class Id>
  auto& at(Id id) {
    return checked(find(id));
  }
  template <class Id>
  const auto& at(Id id) const {
    return checked(find(id));
  }

  /// Takes a state out together with every factor that touches it (a marginal prior as a whole).
  /// Returns how many factors went. Linear in the size of the graph: meant for tools, not for the
  /// window's daily work.
  std::size_t remove(KeyframeId id);
  std::size_t remove(PlaneId id);
  std::size_t remove(SurfelId id);

  /// Gives every factor of `from` to `into`, adds up outline, votes and counts, and marks `from`
  /// inactive. The outline's cells are re-expressed in the frame of `into`.
  void merge_planes(PlaneId from, PlaneId into);

  /// The same graph in another map frame: poses, planes, priors and covariances move as one body.
  /// Gravity and custom factors say where the map is: none may be there (std::logic_error).
  void move(const SE3& T_new_map);

  std::size_t factor_count() const;
  /// One line for every broken reference, non-finite number or unsorted id; empty: sound.
  std::vector<std::string> problems() const;

 private:
  [[noreturn]] static void missing();
  template <class T>
  static T& checked(T* state) {
    if (state == nullptr) missing();
    return *state;
  }
};

}  // namespace lamina
