// Mapper::add and its steps; the refined map and the window.
#include <lamina/backend/mapper/mapper.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <span>

#include <lamina/backend/association/connected_ground.hpp>
#include <lamina/backend/mapper/fallen_planes.hpp>
#include <lamina/backend/mapper/observing_sensor.hpp>
#include <lamina/backend/mapper/plane_information.hpp>
#include <lamina/backend/mapper/plane_loop.hpp>
#include <lamina/backend/mapper/plane_revision.hpp>
#include <lamina/backend/mapper/view_association.hpp>
#include <lamina/backend/solver/covariance.hpp>
#include <lamina/models/error.hpp>

namespace lamina {
namespace {

// The first keyframe defines the map: held to a tenth of a millimetre.
constexpr double kHeldSigma = 1e-4;

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

bool usable(const SE3& T) {
  return T.translation().allFinite() && T.so3().quaternion().coeffs().allFinite();
}

void append_finite(const std::vector<Eigen::Vector3d>& points_body, const SE3& T_keyframe_body,
                   std::vector<Eigen::Vector3d>& points_keyframe) {
  points_keyframe.reserve(points_keyframe.size() + points_body.size());  // and no more
  for (const auto& p : points_body) {
    if (p.allFinite()) points_keyframe.push_back(T_keyframe_body * p);
  }
}

// Small pieces of floor in the sensor's frame, each with the information that is its own.
std::vector<Moments> patches_of(const Observations& observations) {
  std::vector<Moments> patches;
  for (const auto& patch : observations.floor_patches) {
    // Its own plane takes the noise floor; a patch too thin for a plane says nothing of a surfel.
    const auto fit = patch.moments_sensor.fit_plane(Eigen::Vector3d::Zero(), 1.0);
    if (!fit) continue;
    patches.push_back(patch.moments_sensor.discounted(fit->plane.normal(), patch.floor));
  }
  return patches;
}

// `view_of`: by plane and segment observed.
std::vector<AssociationDecision> by_observation(const std::vector<AssociationDecision>& by_view,
                                                const std::vector<std::size_t>& view_of) {
  std::vector<AssociationDecision> all;
  for (const std::size_t view : view_of) all.push_back(by_view[view]);
  return all;
}

std::vector<Moments> transformed(const std::vector<Moments>& moments, const SE3& T) {
  std::vector<Moments> all;
  all.reserve(moments.size());
  for (const Moments& m : moments) all.push_back(m.transformed(T));
  return all;
}

}  // namespace

struct Mapper::Step {
  const Observations& observations;
  SE3 T_prev_body;
  Matrix6d increment_covariance;
  FrameViews views = {};
  std::vector<Moments> patches_sensor = {};  // of floor
  std::vector<std::size_t> view_of = {};     // by plane and segment observed: its view
  BodyInKeyframe odometry = {};
  BodyPose body = {};                                    // predicted
  std::vector<std::optional<std::size_t>> forming = {};  // by view: the forming plane it is of
  ExtrinsicsId sensor = ExtrinsicsId::kNone;
  AddResult result = {};
};

AddResult Mapper::add(const Observations& observations, const SE3& T_prev_body,
                      const Matrix6d& increment_covariance, bool motion_of_sensor) {
  Step step{observations, usable(T_prev_body) ? T_prev_body : SE3(), increment_covariance};
  step.sensor = observing_sensor(observations, map_.graph);
  if (motion_of_sensor) moved_by_ = step.sensor;
  const auto begin = std::chrono::steady_clock::now();
  predict(step);      // where odometry says the body is
  join_ground(step);  // pieces of ground that swells are one floor
  ViewAssociation found = associate_views(map_, formation_, step.views, step.body);
  step.result.decisions = std::move(found.decisions);
  step.forming = std::move(found.forming);
  const bool starts = wants_keyframe(step);
  if (starts) start_keyframe(step);
  gather(step);  // evidence joins planes, new ones form
  step.result.associate_ms = milliseconds_since(begin);
  const auto middle = std::chrono::steady_clock::now();
  if (starts) {
    solve_window(step);  // estimate, then marginalise what is beyond the lag
    tidy(step);          // merge what is one plane, recognise old ones
    step.result.window_ms = milliseconds_since(middle);
  } else {  // between keyframes the planes hold still
    estimate_ = localized(map_, step.views.evidence, step.result.decisions, estimate_);
  }
  step.result.decisions = by_observation(step.result.decisions, step.view_of);
  map_.frames.add({observations.stamp, map_.keyframe, estimate_.T_keyframe_body});
  step.result.keyframe = map_.keyframe;
  step.result.is_keyframe = starts;
  step.result.T_map_body = current_pose();
  return step.result;
}

Mapper::Mapper(const MapperOptions& options) : map_(options) {}

Mapper::Mapper(const MapperOptions& options, MapState map) : Mapper(options) {
  map_.graph = std::move(map.graph);
  for (const MapFrame& frame : map.frames) map_.frames.add(frame);
  map_.left_window = std::move(map.left_window);
  map_.outlines = std::move(map.outlines);
  map_.partial = std::move(map.partial);
  map_.surfels = std::move(map.surfels);
  map_.loose_body = std::move(map.loose_body);
  const auto& keyframes = map_.graph.keyframes;
  if (!keyframes.empty()) retirement_ = KeyframeRetirement(keyframes.back().id);
  parameters_.extrinsics = map.extrinsics_covariance;
  set_wheel_covariance(map.wheel_covariance);
}

MapState Mapper::state() const {
  MapState map{map_.graph,        {},           map_.left_window, map_.outlines,
               map_.partial,      map_.surfels, map_.loose_body,  parameters_.extrinsics,
               parameters_.wheels};
  map.frames.reserve(map_.frames.size());
  map_.frames.for_each([&map](const MapFrame& frame) { map.frames.push_back(frame); });
  for (const auto& [id, joint] : map_.joint) {
    PlaneLandmark* plane = map.graph.find(id);
    if (plane) plane->covariance = joint.bottomRightCorner<3, 3>();
  }
  return map;
}

void Mapper::predict(Step& step) const {
  FrameViews& views = step.views;
  views.evidence = make_evidence(step.observations, map_.options.partial_view);
  for (PlaneEvidence& evidence : views.evidence) evidence.sensor = step.sensor;
  views.tracks.assign(step.observations.planes.size(), -1);
  // A level scanner's walls stand where they are expected: there a track adds nothing but its
  // mistakes at corners.
  const SE3& T_body_sensor = step.observations.T_body_sensor;
  const bool level = scan_is_level(T_body_sensor.so3() * Eigen::Vector3d::UnitZ());
  for (const auto& o : step.observations.segments) views.tracks.push_back(level ? -1 : o.track);
  step.odometry = odometry_;
  step.body.relative = estimate_;
  if (map_.keyframe == KeyframeId::kNone) {
    step.body.T_map_body = step.T_prev_body;
    return;
  }
  // A covariance that is none must not poison the window: odometry that knows nothing.
  const Eigen::LLT<Matrix6d> llt(step.increment_covariance);
  if (!step.increment_covariance.allFinite() || llt.info() != Eigen::Success) {
    step.increment_covariance = Matrix6d::Identity();
  }
  if (map_.options.ground.enabled && map_.ground.swells()) {
    const Eigen::Vector2d lift =
        map_.ground.lift_variances(step.T_prev_body.translation().norm(), map_.options.ground);
    step.increment_covariance.diagonal().segment<3>(2) +=
        Eigen::Vector3d(lift.x(), lift.y(), lift.y());
  }
  step.odometry.advance(step.T_prev_body, step.increment_covariance);
  step.body.relative.advance(step.T_prev_body, step.increment_covariance);
  step.body.T_map_body = map_.T_map_keyframe() * step.body.relative.T_keyframe_body;
}

void Mapper::join_ground(Step& step) {
  FrameViews& views = step.views;
  step.patches_sensor = patches_of(step.observations);
  step.view_of.resize(views.evidence.size());
  std::iota(step.view_of.begin(), step.view_of.end(), std::size_t{0});
  const ConnectedGroundOptions& options = map_.options.ground;
  if (!options.enabled || step.patches_sensor.empty()) return;
  const auto ground = connected_ground(
      views.evidence, transformed(step.patches_sensor, step.observations.T_body_sensor),
      map_.ground.swells(), options);
  map_.ground.add(ground, options);
  if (!map_.ground.swells() || !ground) return;
  const std::size_t kept = ground->pieces.front();
  views.evidence[kept] = map_.ground.as_one(*ground, options);
  std::vector<bool> joined(views.evidence.size(), false);
  for (const std::size_t piece : ground->pieces) joined[piece] = piece != kept;
  FrameViews reduced;
  for (std::size_t i = 0; i < views.evidence.size(); ++i) {
    if (joined[i]) continue;
    step.view_of[i] = reduced.evidence.size();
    reduced.evidence.push_back(std::move(views.evidence[i]));
    reduced.tracks.push_back(views.tracks[i]);
  }
  for (std::size_t i = 0; i < joined.size(); ++i) {
    if (joined[i]) step.view_of[i] = step.view_of[kept];
  }
  views = std::move(reduced);
}

bool Mapper::wants_keyframe(const Step& step) const {
  if (map_.keyframe == KeyframeId::kNone) return true;
  const MapperOptions& options = map_.options;
  const SE3& T = step.odometry.T_keyframe_body;
  const double moved =
      std::max(T.translation().norm() / options.keyframe_distance_m,
               T.so3().log().norm() / (options.keyframe_angle_deg * (M_PI / 180.0)));
  if (moved >= 1) return true;
  const std::size_t views = step.views.evidence.size();
  if (moved < 0.25 || views == 0) return false;
  std::size_t unknown = 0;
  for (std::size_t i = 0; i < views; ++i) {
    const bool found = step.result.decisions[i].plane != PlaneId::kNone || step.forming[i];
    unknown += found ? 0 : 1;
  }
  return static_cast<double>(unknown) >= options.keyframe_new_share * static_cast<double>(views);
}

void Mapper::start_keyframe(Step& step) {
  const KeyframeId before = map_.keyframe;
  const SE3& T_map_body = step.body.T_map_body;
  map_.keyframe = map_.graph.add_keyframe(step.observations.stamp, T_map_body);
  map_.window.add_keyframe(map_.keyframe, step.observations.stamp, T_map_body);
  ++keyframes_made_;
  if (before == KeyframeId::kNone) {
    map_.graph.at(map_.keyframe).fixed = true;
    map_.window.add(PriorFactor{map_.keyframe, T_map_body, Matrix6d::Identity() / kHeldSigma});
  } else {
    const Eigen::LLT<Matrix6d> llt(step.odometry.covariance);
    const Matrix6d S = llt.matrixL().solve(Matrix6d::Identity());
    OdometryFactor factor{before, map_.keyframe, step.odometry.T_keyframe_body, S, moved_by_};
    map_.graph.odometry.push_back(factor);
    Vector6d trust = Vector6d::Constant(map_.options.window_motion_trust);
    if (!map_.options.window_trusts_tilt) trust.segment<3>(2).setOnes();
    factor.sqrt_information *= trust.asDiagonal();
    map_.window.add(factor);
  }
  // From here the body is at its keyframe; the last solution's uncertainties stay with the last
  // keyframe until the next solution, a moment from now.
  map_.gathered.clear();
  moved_by_ = ExtrinsicsId::kNone;
  step.odometry = step.body.relative = BodyInKeyframe();
}

void Mapper::gather(Step& step) {
  odometry_ = step.odometry;
  estimate_ = step.body.relative;
  map_.first_floor_map = step.observations.first_floor_map;
  const SE3& T = odometry_.T_keyframe_body;
  const Timestamp stamp = step.observations.stamp;
  for (std::size_t i = 0; i < step.views.evidence.size(); ++i) {
    const AssociationDecision& decision = step.result.decisions[i];
    if (decision.reason == AssociationReason::kTooWeak ||
        decision.reason == AssociationReason::kAmbiguous) {
      continue;
    }
    const PlaneEvidence evidence = moved(step.views.evidence[i], T, odometry_.covariance);
    if (decision.plane != PlaneId::kNone) {
      map_.observe(decision.plane, evidence, stamp);
      formation_.link(step.views.tracks[i], decision.plane, map_.keyframe);
    } else {
      formation_.add(map_, step.forming[i], evidence, step.views.tracks[i], stamp);
    }
  }
  step.result.new_planes = formation_.promote(map_);
  formation_.forget(map_.keyframe, map_.options.forget_keyframes);
  const auto patches = transformed(step.patches_sensor, T * step.observations.T_body_sensor);
  for (const Moments& patch : patches) map_.surfels.add(map_.keyframe, patch);
  window_surfels_.add(map_, patches);
  if (step.result.is_keyframe || !map_.loose_body.count(map_.keyframe)) {
    append_finite(step.observations.obstacle_points_body, T, map_.loose_body[map_.keyframe]);
  }
}

void Mapper::solve_window(Step& step) {
  WindowReport report = map_.window.solve();
  if (report.finite && hold_fallen(map_) > 0) report = map_.window.solve();
  step.result.window = report;
  if (!report.finite) return;
  map_.take_window_estimates();
}

void Mapper::tidy(Step& step) {
  if (map_.options.merge_planes) step.result.merged = merging_.merge_coplanar(map_);
  const WindowDepartures gone = map_.window.marginalize();
  for (const auto& plane : gone.planes) {
    if (plane.covariance.allFinite()) map_.graph.at(plane.id).covariance = plane.covariance;
    map_.joint.erase(plane.id);
  }
  for (const auto& pose : gone.poses) map_.left_window[pose.id] = pose.T_map_body;
  const PlaceRecognitionOptions& place = map_.options.place;
  if (place.enabled && keyframes_made_ % place.every_keyframes == 0) {
    step.result.loop_closed = close_plane_loop(map_, merging_);
    if (step.result.loop_closed) formation_.refit(map_);
  }
  for (const auto& pose : gone.poses) retirement_.departed(map_, pose.id);
}

bool Mapper::add_loop(KeyframeId from, KeyframeId to, const SE3& T_from_to,
                      const Matrix6d& covariance, ExtrinsicsId sensor) {
  if (from == to || !map_.graph.find(from) || !map_.graph.find(to)) return false;
  const Eigen::LLT<Matrix6d> llt(covariance);
  if (!covariance.allFinite() || llt.info() != Eigen::Success) return false;
  if (!T_from_to.translation().allFinite()) return false;
  const Matrix6d S = llt.matrixL().solve(Matrix6d::Identity());
  const LoopFactor factor{from, to, T_from_to, S, 1.0, sensor};
  map_.graph.loops.push_back(factor);
  map_.window.add(factor);  // where both ends are in it
  return true;
}

void Mapper::add_factor(const CustomFactor& factor) {
  const std::string problem = problem_of(factor, map_.graph);
  if (!problem.empty()) {
    throw Error("factor '" + factor.kind + "' " + problem + ", expected states of this map");
  }
  map_.graph.custom.push_back(factor);
  map_.window.add(factor);  // where it is of keyframes that are in it
}

CustomStateId Mapper::add_state(const CustomState& state) {
  const std::string problem = problem_of(state);
  if (!problem.empty())
    throw Error("state " + problem + ", expected finite numbers, and as many as its manifold has");
  return map_.graph.add_custom_state(state);
}

std::optional<MapFrame> Mapper::keyframe_at(Timestamp stamp, double tolerance_s) const {
  std::optional<MapFrame> nearest;
  double off = tolerance_s;
  map_.frames.for_each([&](const MapFrame& frame) {
    const double seconds = std::abs(frame.stamp - stamp);
    if (seconds > off || !map_.graph.find(frame.keyframe)) return;
    off = seconds;
    nearest = frame;
  });
  return nearest;
}

RefineResult Mapper::refine(RefineOptions options,
                            const std::function<bool(const RefineProgress&)>& progress) {
  options.engine = map_.options.window.engine;
  const bool moving = map_.keyframe != KeyframeId::kNone;
  const SE3 before = moving ? map_.T_map_keyframe() : SE3();
  add_joint_surfels(map_.graph, map_.surfels, map_.options.joint_surfels);
  RefineResult result = lamina::refine(map_.graph, options, progress);
  if (result.status != SolveStatus::kCancelled && result.status != SolveStatus::kInvalidInput) {
    result = revise_planes(map_, merging_, std::move(result), options, progress);
    merging_.refined();
  }
  remove_surfels(map_.graph);
  drop_unsupported(map_);
  retirement_.refined(map_.keyframe);
  if (!moving) return result;
  window_surfels_.forget();
  // The window follows as one body: its prior says nothing about where it is, only how it hangs
  // together.
  map_.window.move(map_.T_map_keyframe() * before.inverse());
  for (const PlaneId id : map_.window.planes()) {
    map_.window.set_anchor(id, map_.graph.at(id).anchor_map);
  }
  formation_.refit(map_);
  return result;
}

void Mapper::know_covariances() {
  add_joint_surfels(map_.graph, map_.surfels, map_.options.joint_surfels);
  store_covariances(map_.graph);
  remove_surfels(map_.graph);
  map_.joint.clear();
  set_wheel_covariance(parameters_.wheels);
}

void Mapper::move(const SE3& T_new_map) {
  map_.move(T_new_map);
  merging_.move(T_new_map);
  window_surfels_.forget();
  formation_.refit(map_);
}

SE3 Mapper::current_pose() const {
  if (map_.keyframe == KeyframeId::kNone) return SE3();
  return map_.T_map_keyframe() * estimate_.T_keyframe_body;
}

Matrix6d Mapper::current_covariance() const {
  const Matrix6d A = estimate_.T_keyframe_body.inverse().adjoint();
  return A * map_.keyframe_covariance * A.transpose() + estimate_.covariance;
}

}  // namespace lamina
