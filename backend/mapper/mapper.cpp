// Mapper::add and its steps.
#include <lamina/backend/mapper/mapper.hpp>

#include <Eigen/Cholesky>
#include <chrono>
#include <cmath>

#include <lamina/backend/mapper/mapper_step.hpp>
#include <lamina/models/error.hpp>
#include <lamina/models/linalg.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kLevelScan = 0.94;  // cosine: within 20 degrees
// The first keyframe defines the map: held to a tenth of a millimetre.
constexpr double kHeldSigma = 1e-4;

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

const MapperOptions& checked(const MapperOptions& options) {
  const auto problems = options.problems();
  if (!problems.empty()) throw Error(problems.front());
  return options;
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

void add_floor(const Observations& observations, KeyframeId keyframe, const SE3& T_keyframe_sensor,
               SurfelEvidence& surfels) {
  for (const auto& patch : observations.floor_patches) {
    // Its own plane takes the noise floor; a patch too thin for a plane says nothing of a surfel.
    const auto fit = patch.moments_sensor.fit_plane(Eigen::Vector3d::Zero(), 1.0);
    if (!fit) continue;
    const Moments m = patch.moments_sensor.discounted(fit->plane.normal(), patch.floor);
    surfels.add(keyframe, m.transformed(T_keyframe_sensor));
  }
}

}  // namespace

AddResult Mapper::add(const Observations& observations, const SE3& T_prev_body,
                      const Matrix6d& increment_covariance) {
  Step step{observations, usable(T_prev_body) ? T_prev_body : SE3(), increment_covariance};
  const auto begin = std::chrono::steady_clock::now();
  predict(step);        // where odometry says the body is
  associate_all(step);  // which known planes these observations are of
  const bool starts = wants_keyframe(step);
  if (starts) start_keyframe(step);
  gather(step);  // evidence joins planes, new ones form
  step.result.associate_ms = milliseconds_since(begin);
  const auto middle = std::chrono::steady_clock::now();
  if (starts) {
    solve_window(step);  // estimate, then marginalise what is beyond the lag
    tidy(step);          // merge what is one plane, recognise old ones
    step.result.window_ms = milliseconds_since(middle);
  } else {
    localize(step);  // between keyframes the planes hold still
  }
  frames_.add({observations.stamp, keyframe_, estimate_.T_keyframe_body});
  step.result.keyframe = keyframe_;
  step.result.is_keyframe = starts;
  step.result.T_map_body = current_pose();
  return step.result;
}

Mapper::Mapper(const MapperOptions& options)
    : options_(checked(options)),
      window_(options.window),
      index_(options.association.max_gap_m),
      surfels_(options.surfel_cell_m) {}

void Mapper::Relative::advance(const SE3& T_prev_body, const Matrix6d& increment) {
  const Matrix6d A = T_prev_body.inverse().adjoint();
  T_keyframe_body = T_keyframe_body * T_prev_body;
  covariance = A * covariance * A.transpose() + increment;
}

void Mapper::predict(Step& step) const {
  step.evidence = make_evidence(step.observations);
  step.tracks.assign(step.observations.planes.size(), -1);
  // A level scanner's walls stand where they are expected: there a track adds nothing but its
  // mistakes at corners.
  const SE3& T_body_sensor = step.observations.T_body_sensor;
  const bool level = std::abs((T_body_sensor.so3() * Eigen::Vector3d::UnitZ()).z()) > kLevelScan;
  for (const auto& o : step.observations.segments) step.tracks.push_back(level ? -1 : o.track);
  step.odometry = odometry_;
  step.estimate = estimate_;
  if (keyframe_ == KeyframeId::kNone) {
    step.T_map_body = step.T_prev_body;
    return;
  }
  // A covariance that is none must not poison the window: odometry that knows nothing.
  const Eigen::LLT<Matrix6d> llt(step.increment_covariance);
  if (!step.increment_covariance.allFinite() || llt.info() != Eigen::Success) {
    step.increment_covariance = Matrix6d::Identity();
  }
  step.odometry.advance(step.T_prev_body, step.increment_covariance);
  step.estimate.advance(step.T_prev_body, step.increment_covariance);
  step.T_map_body = graph_.at(keyframe_).T_map_body * step.estimate.T_keyframe_body;
}

// --------------------------------------------------------------------------- keyframes

bool Mapper::wants_keyframe(const Step& step) const {
  if (keyframe_ == KeyframeId::kNone) return true;
  const SE3& T = step.odometry.T_keyframe_body;
  const double moved = std::max(T.translation().norm() / options_.keyframe_distance_m,
                                T.so3().log().norm() / (options_.keyframe_angle_deg * kDegree));
  if (moved >= 1) return true;
  if (moved < 0.25 || step.evidence.empty()) return false;
  std::size_t unknown = 0;
  for (std::size_t i = 0; i < step.evidence.size(); ++i) {
    const bool found = step.result.decisions[i].plane != PlaneId::kNone || step.tentative[i];
    unknown += found ? 0 : 1;
  }
  return static_cast<double>(unknown) >=
         options_.keyframe_new_share * static_cast<double>(step.evidence.size());
}

void Mapper::start_keyframe(Step& step) {
  const KeyframeId before = keyframe_;
  keyframe_ = graph_.add_keyframe(step.observations.stamp, step.T_map_body);
  window_.add_keyframe(keyframe_, step.observations.stamp, step.T_map_body);
  ++keyframes_made_;
  if (before == KeyframeId::kNone) {
    graph_.at(keyframe_).fixed = true;
    window_.add(PriorFactor{keyframe_, step.T_map_body, Matrix6d::Identity() / kHeldSigma});
  } else {
    const Eigen::LLT<Matrix6d> llt(step.odometry.covariance);
    const Matrix6d S = llt.matrixL().solve(Matrix6d::Identity());
    OdometryFactor factor{before, keyframe_, step.odometry.T_keyframe_body, S};
    graph_.odometry.push_back(factor);
    Vector6d trust = Vector6d::Constant(options_.window_motion_trust);
    if (!options_.window_trusts_tilt) trust.segment<3>(2).setOnes();
    factor.sqrt_information *= trust.asDiagonal();
    window_.add(factor);
  }
  // From here the body is at its keyframe; the last solution's uncertainties stay with the last
  // keyframe until the next solution, a moment from now.
  odometry_ = estimate_ = Relative();
  gathered_.clear();
  step.odometry = step.estimate = Relative();
}

// ----------------------------------------------------------------------------- evidence

void Mapper::gather(Step& step) {
  odometry_ = step.odometry;
  estimate_ = step.estimate;
  first_floor_map_ = step.observations.first_floor_map;
  const SE3& T = odometry_.T_keyframe_body;
  const Timestamp stamp = step.observations.stamp;
  for (std::size_t i = 0; i < step.evidence.size(); ++i) {
    const AssociationDecision& decision = step.result.decisions[i];
    if (decision.reason == AssociationReason::kTooWeak ||
        decision.reason == AssociationReason::kAmbiguous) {
      continue;
    }
    const PlaneEvidence evidence = moved(step.evidence[i], T, odometry_.covariance);
    if (decision.plane != PlaneId::kNone) {
      add_to_plane(decision.plane, evidence, stamp);
      link_track(step.tracks[i], decision.plane);
    } else if (step.tentative[i]) {
      add_to_tentative(*step.tentative[i], evidence, step.tracks[i], stamp);
    } else {
      tentatives_.emplace_back();
      add_to_tentative(tentatives_.size() - 1, evidence, step.tracks[i], stamp);
    }
  }
  for (auto& tentative : tentatives_) {
    if (tentative.landmark.observations < options_.min_observations) continue;
    if (const auto id = promote(tentative)) step.result.new_planes.push_back(*id);
  }
  const auto forgotten = [this](KeyframeId last) {
    return static_cast<std::int64_t>(keyframe_) - static_cast<std::int64_t>(last) >
           options_.forget_keyframes;
  };
  std::erase_if(tentatives_,
                [&](const Tentative& t) { return t.evidence.empty() || forgotten(t.last); });
  std::erase_if(tracks_, [&](const auto& link) { return forgotten(link.second.last); });
  add_floor(step.observations, keyframe_, T * step.observations.T_body_sensor, surfels_);
  if (step.result.is_keyframe || !loose_body_.count(keyframe_)) {
    append_finite(step.observations.obstacle_points_body, T, loose_body_[keyframe_]);
  }
}

Moments Mapper::factor_moments(const PlaneEvidence& e) const {
  NoiseFloor floor = e.floor;
  floor.sigma_rho = std::hypot(floor.sigma_rho, options_.association.surface_sigma_m);
  floor.sigma_tilt = std::hypot(floor.sigma_tilt, options_.association.surface_sigma_deg * kDegree);
  const bool level = std::abs(e.scan_normal_body.z()) > kLevelScan;
  if (!e.partial || level) return e.moments_body.discounted(e.plane_body.normal(), floor);
  // Lines of a leaning scanner that moved span a plane that need not be upright on them: each axis
  // of their extent as it is. (Those of a level one lie in one level plane, whatever they are of:
  // how they scatter across each other is noise.)
  const Moments& m = e.moments_body;
  const SymmetricEigen<3> eigen = symmetric_eigen(m.scatter());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const double information = std::max(0.0, eigen.values(i));
    const Eigen::Vector3d axis = eigen.vectors.col(i);
    scatter += information / (1 + information * floor.sigma_tilt * floor.sigma_tilt) * axis *
               axis.transpose();
  }
  const double weight = m.weight() / (1 + m.weight() * floor.sigma_rho * floor.sigma_rho);
  return Moments(weight, m.mean(), scatter, m.count());
}

Moments Mapper::factor_moments(const PlaneViews& views) const {
  Moments m;
  if (views.full()) m.merge(factor_moments(*views.full()));
  if (views.lines()) m.merge(factor_moments(*views.lines()));
  return m;
}

void Mapper::add_to_plane(PlaneId id, const PlaneEvidence& evidence, Timestamp stamp) {
  ensure_in_window(id, evidence);
  PlaneLandmark& plane = graph_.at(id);
  auto known = gathered_.find(id);
  if (known == gathered_.end()) {
    known = gathered_.emplace(id, PlaneViews(evidence)).first;
    graph_.plane_moments.push_back({keyframe_, id, {}, ExtrinsicsId::kNone, 1.0});
    // One outline a keyframe: more of the same view adds nothing.
    std::vector<Eigen::Vector3d> points;
    const SE3& T = graph_.at(keyframe_).T_map_body;
    for (const auto& p : evidence.outline_body) points.push_back(T * p);
    grow_outline(plane, points);
    outlines_[id].push_back({keyframe_, evidence.outline_body});
    index_.insert_outline(id, points);
  } else {
    known->second.join(evidence);
  }
  auto factor = std::find_if(
      graph_.plane_moments.rbegin(), graph_.plane_moments.rend(),
      [&](const PlaneMomentsFactor& f) { return f.keyframe == keyframe_ && f.plane == id; });
  if (factor == graph_.plane_moments.rend()) {
    // A refinement since gave what the keyframe had seen to another plane: begun anew.
    known->second = PlaneViews(evidence);
    graph_.plane_moments.push_back({keyframe_, id, {}, ExtrinsicsId::kNone, 1.0});
    factor = graph_.plane_moments.rbegin();
  }
  factor->moments_body = factor_moments(known->second);
  window_.set(*factor);
  ++plane.observations;
  plane.last_seen = std::max(plane.last_seen, stamp);
  plane.votes.floor += evidence.votes.floor;
  plane.votes.sub_dominant += evidence.votes.sub_dominant;
  plane.votes.obstacle += evidence.votes.obstacle;
  if (!evidence.partial) partial_.erase(id);
}

void Mapper::ensure_in_window(PlaneId id, const PlaneEvidence& evidence) {
  if (window_.contains(id)) return;
  const PlaneLandmark& plane = graph_.at(id);
  if (window_.add_plane(id, plane.plane_anchor, plane.anchor_map, plane.covariance)) return;
  if (!partial_.count(id)) return;
  // Upright on the scan, as when it was new. About its present tilt the prior would follow every
  // return's noise, and after many a wall would lie flat in the scan, where it fits all there is.
  const Plane& now = plane.plane_anchor;
  Eigen::Vector3d upright = now.normal();
  if (evidence.partial) {
    const Eigen::Vector3d scan = graph_.at(keyframe_).T_map_body.so3() * evidence.scan_normal_body;
    upright -= upright.dot(scan) * scan;
  }
  const auto at = Plane::from_normal_rho(upright, now.rho() * upright.norm());
  window_.add_prior(id, at.value_or(now), options_.prior_tilt_deg * kDegree,
                    options_.prior_distance_m);
}

// --------------------------------------------------------------------------- estimation

// The body's pose relative to its keyframe, planes held: prior from odometry, planes as seen.
Mapper::Relative Mapper::located(const Relative& predicted, const Step& step) const {
  const SE3 T_map_keyframe = graph_.at(keyframe_).T_map_body;
  const Eigen::LLT<Matrix6d> llt(predicted.covariance);
  if (llt.info() != Eigen::Success) return predicted;
  const Matrix6d prior = llt.solve(Matrix6d::Identity());
  SE3 T = predicted.T_keyframe_body;
  Matrix6d H = prior;
  for (int round = 0; round < 2; ++round) {
    const Vector6d off = (predicted.T_keyframe_body.inverse() * T).log();
    H = prior;
    Vector6d g = prior * off;
    for (std::size_t i = 0; i < step.evidence.size(); ++i) {
      const PlaneId id = step.result.decisions[i].plane;
      if (id == PlaneId::kNone) continue;
      const PlaneLandmark& plane = graph_.at(id);
      const Moments m = factor_moments(step.evidence[i]);
      const SE3 T_map_body = T_map_keyframe * T;
      const Eigen::Vector3d n = T_map_body.so3().inverse() * plane.plane_anchor.normal();
      const double d = plane.plane_anchor.signed_distance(T_map_body * m.mean() - plane.anchor_map);
      const Eigen::Matrix3d turn = SO3::hat(n);
      Vector6d along;
      along << n, m.mean().cross(n);
      Matrix6d information = m.weight() * along * along.transpose();
      information.bottomRightCorner<3, 3>() += turn.transpose() * m.scatter() * turn;
      Vector6d gradient = m.weight() * d * along;
      gradient.tail<3>() += turn.transpose() * (m.scatter() * n);
      const double chi = m.weight() * d * d + n.dot(m.scatter() * n);
      const double bound = options_.window.robust_chi_squared;
      const double weight = chi <= bound ? 1.0 : std::sqrt(bound / chi);
      H += weight * information;
      g += weight * gradient;
    }
    const Vector6d delta = H.llt().solve(-g);
    if (!delta.allFinite()) return predicted;
    T = T * SE3::exp(delta);
  }
  return {T, H.llt().solve(Matrix6d::Identity())};
}

void Mapper::localize(Step& step) { estimate_ = located(estimate_, step); }

void Mapper::solve_window(Step& step) {
  WindowReport report = window_.solve();
  if (report.finite && hold_fallen() > 0) report = window_.solve();
  step.result.window = report;
  if (!report.finite) return;
  for (const KeyframeId id : window_.keyframes()) graph_.at(id).T_map_body = window_.pose(id);
  for (const PlaneId id : window_.planes()) {
    graph_.at(id).set_plane_anchor(window_.plane_anchor(id));
  }
  keyframe_covariance_ = window_.newest_covariance();
  joint_.clear();
  for (const auto& [id, C] : window_.joint_covariances(window_.planes())) joint_.emplace(id, C);
}

// Lines that contradict each other (a bent wall, a pose that is off) agree best on a plane that
// lies in the scan, which no beam can meet: what has fallen that way is stood up and held, in the
// window alone: the graph's own prior is about upright already.
std::size_t Mapper::hold_fallen() {
  constexpr double kFallen = 0.5;      // sine of what a wall may lean on the scan: 30 degrees
  constexpr double kSigmaShare = 0.2;  // of the prior's
  std::size_t held = 0;
  for (const auto& [id, views] : gathered_) {
    if (!partial_.count(id) || !views.partial() || !window_.contains(id)) continue;
    const PlaneEvidence& evidence = views.best();
    const Eigen::Vector3d scan = window_.pose(keyframe_).so3() * evidence.scan_normal_body;
    const Plane now = window_.plane_anchor(id);
    const double lean = now.normal().dot(scan);
    if (std::abs(lean) < kFallen) continue;
    // The line it makes in the scan now says nothing: the one that was seen does.
    Eigen::Vector3d upright = window_.pose(keyframe_).so3() * evidence.plane_body.normal();
    upright -= upright.dot(scan) * scan;
    const auto at = Plane::from_normal_rho(upright, 0);
    if (!at) continue;
    const Eigen::Vector3d seen = window_.pose(keyframe_) * evidence.moments_body.mean();
    const double rho = at->normal().dot(seen - graph_.at(id).anchor_map);
    held += window_.add_prior(id, Plane(at->normal(), rho),
                              kSigmaShare * options_.prior_tilt_deg * kDegree,
                              options_.prior_distance_m);
  }
  return held;
}

void Mapper::tidy(Step& step) {
  if (options_.merge_planes) step.result.merged = merge_coplanar();
  const WindowDepartures gone = window_.marginalize();
  for (const auto& plane : gone.planes) {
    if (plane.covariance.allFinite()) graph_.at(plane.id).covariance = plane.covariance;
    joint_.erase(plane.id);
  }
  for (const auto& pose : gone.poses) left_window_[pose.id] = pose.T_map_body;
  if (options_.place.enabled && keyframes_made_ % options_.place.every_keyframes == 0) {
    step.result.loop_closed = recognise();
  }
  for (const auto& pose : gone.poses) {
    if (!retire(pose.id)) stayed_.push_back(pose.id);
  }
}

SE3 Mapper::current_pose() const {
  if (keyframe_ == KeyframeId::kNone) return SE3();
  return graph_.at(keyframe_).T_map_body * estimate_.T_keyframe_body;
}

Matrix6d Mapper::current_covariance() const {
  const Matrix6d A = estimate_.T_keyframe_body.inverse().adjoint();
  return A * keyframe_covariance_ * A.transpose() + estimate_.covariance;
}

}  // namespace lamina
