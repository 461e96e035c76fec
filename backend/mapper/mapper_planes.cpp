// Planes of the map: forming, entering, merging, coming back.
#include <Eigen/Cholesky>
#include <cmath>

#include <lamina/backend/association/level_separation.hpp>
#include <lamina/backend/association/outline_gap.hpp>
#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/backend/mapper/mapper_step.hpp>
#include <lamina/models/linalg.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;

// Information of discounted moments (map axes) on a plane's tangent (tilt, tilt, rho) about the
// moments' mean.
Eigen::Matrix3d plane_information(const Moments& m, const Eigen::Vector3d& normal) {
  const Matrix32d B = Plane::tangent_basis(normal);
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  H.topLeftCorner<2, 2>() = B.transpose() * m.scatter() * B;
  H(2, 2) = m.weight();
  return H;
}

// The plane through partial views: along their common line, as upright on the scans as a prior of
// `tilt_sigma` and what the views say of the tilt leave it. The best of
//   n^T S n + |n - n_upright|^2 / tilt_sigma^2   over unit n, by Gauss-Newton; it goes through the
// moments' mean.
std::optional<Plane> upright_plane(const Moments& m, const Eigen::Vector3d& scan_normal,
                                   const Eigen::Vector3d& towards, double tilt_sigma) {
  const auto line = m.fit_line();
  if (!line) return std::nullopt;
  Eigen::Vector3d upright = line->direction.cross(scan_normal);
  // Views that moved along their plane have their longest extent that way, not along the scan.
  if (upright.norm() < 0.5) upright = towards - towards.dot(scan_normal) * scan_normal;
  if (!(upright.norm() > 1e-6)) return std::nullopt;
  if (upright.dot(towards) < 0) upright = -upright;
  upright.normalize();
  const double prior = 1 / (tilt_sigma * tilt_sigma);
  Eigen::Vector3d n = upright;
  for (int round = 0; round < 10; ++round) {
    const Matrix32d B = Plane::tangent_basis(n);
    const Eigen::Matrix2d H = B.transpose() * m.scatter() * B + prior * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d g = B.transpose() * (m.scatter() * n - prior * upright);
    const Eigen::Vector2d step = -H.ldlt().solve(g);
    if (!step.allFinite()) return std::nullopt;
    n = (n + B * step).normalized();
  }
  if (n.dot(towards) < 0) n = -n;
  return Plane::from_normal_rho(n, n.dot(m.mean()));
}

// Level scanners meet walls; what one that hangs or leans meets may have any tilt.
constexpr double kLevelScan = 0.94;  // cosine: within 20 degrees
constexpr double kOpenTiltDegrees = 45;

// Of a plane's (tilt, tilt, rho) about `middle`, in its own tangent basis; `C` is about its anchor.
Eigen::Matrix3d covariance_about(const PlaneLandmark& plane, const Eigen::Matrix3d& C,
                                 const Eigen::Vector3d& middle) {
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d arm = middle - plane.anchor_map;
  J.bottomLeftCorner<1, 2>() = -arm.transpose() * plane.plane_anchor.tangent_basis();
  return J * C * J.transpose();
}

// Whether two planes are next to each other and agree about `middle`, their covariances being C_a
// and C_b.
bool one_surface(const PlaneLandmark& a, const Eigen::Matrix3d& C_a, const PlaneLandmark& b,
                 const Eigen::Matrix3d& C_b, const Eigen::Vector3d& middle,
                 const AssociationOptions& options) {
  if (angle_between(a.plane_anchor, b.plane_anchor) > options.max_angle_deg * kDegree / 4) {
    return false;
  }
  const Eigen::Vector3d off = a.plane_map().about(middle).boxminus(b.plane_map().about(middle));
  const double surface = options.surface_sigma_m;
  const double tilt = options.surface_sigma_deg * kDegree;
  Eigen::Matrix3d C = covariance_about(a, C_a, middle) + covariance_about(b, C_b, middle);
  C.diagonal() += Eigen::Vector3d(tilt * tilt, tilt * tilt, surface * surface);
  // However unsure, planes this far apart are not made one: a slab lies on its floor.
  return !(std::abs(off.z()) > 5 * surface) && !(off.dot(C.llt().solve(off)) > 7.8) &&
         beside(seen_points_map(a), seen_points_map(b), options.max_gap_m);
}

// Of two factors of one keyframe on one plane the later one goes; the other, or null.
PlaneMomentsFactor* drop_double(std::vector<PlaneMomentsFactor>& factors, KeyframeId keyframe,
                                PlaneId plane) {
  const auto same = [&](const PlaneMomentsFactor& f) {
    return f.keyframe == keyframe && f.plane == plane;
  };
  const auto last = std::find_if(factors.rbegin(), factors.rend(), same);
  if (last != factors.rend()) factors.erase(std::next(last).base());
  const auto rest = std::find_if(factors.rbegin(), factors.rend(), same);
  return rest == factors.rend() ? nullptr : &*rest;
}

KeyframeId oldest(const std::vector<KeyframeId>& keyframes) {
  return *std::min_element(keyframes.begin(), keyframes.end());
}

// Planes near what was seen.
std::vector<PlaneId> near(const PlaneIndex& index, const PlaneEvidence& seen,
                          const SE3& T_map_body) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& p : seen.outline_body) points.push_back(T_map_body * p);
  return seen.partial ? index.near(sample_outline(points, index.cell()))
                      : index.near_close(sample_outline(points, index.small_cell()));
}

}  // namespace

// ------------------------------------------------------------------------------ forming

void Mapper::add_to_tentative(std::size_t index, const PlaneEvidence& evidence, std::int64_t track,
                              Timestamp stamp) {
  Tentative& t = tentatives_[index];
  const auto known = t.evidence.find(keyframe_);
  if (known == t.evidence.end()) {
    t.evidence.emplace(keyframe_, PlaneViews(evidence));
  } else {
    known->second.join(evidence);
  }
  if (t.landmark.observations == 0) t.landmark.first_seen = stamp;
  t.landmark.last_seen = stamp;
  ++t.landmark.observations;
  t.landmark.votes.floor += evidence.votes.floor;
  t.landmark.votes.sub_dominant += evidence.votes.sub_dominant;
  t.landmark.votes.obstacle += evidence.votes.obstacle;
  t.last = keyframe_;
  if (track >= 0) t.tracks.insert(track);
  refit(t);
}

// From all its evidence, not the first sighting: moments add.
void Mapper::refit(Tentative& t) const {
  Moments merged;
  Eigen::Vector3d towards = Eigen::Vector3d::Zero(), scan_normal = Eigen::Vector3d::Zero();
  bool partial = true;
  for (const auto& [id, views] : t.evidence) {
    const Keyframe* keyframe = graph_.find(id);
    if (keyframe == nullptr) continue;
    merged.merge(factor_moments(views).transformed(keyframe->T_map_body));
    towards += keyframe->T_map_body.so3() * views.best().plane_body.normal();
    scan_normal = keyframe->T_map_body.so3() * views.best().scan_normal_body;
    partial = partial && views.partial();
  }
  if (merged.empty() || !merged.mean().allFinite()) {
    t.evidence.clear();
    return;
  }
  const bool level = std::abs(scan_normal.z()) > kLevelScan;
  t.tilt_sigma = (!partial || level ? options_.prior_tilt_deg : kOpenTiltDegrees) * kDegree;
  std::optional<Plane> plane;
  if (partial) {
    plane = upright_plane(merged, scan_normal, towards, t.tilt_sigma);
  } else if (const auto fit = merged.fit_plane(merged.mean() + towards, 1.0)) {
    plane = fit->plane;
  }
  if (!plane) plane = Plane::from_normal_rho(towards, towards.dot(merged.mean()));
  if (!plane) {
    t.evidence.clear();
    return;
  }
  t.landmark.anchor_map = plane->project(merged.mean());
  t.landmark.plane_anchor = plane->about(t.landmark.anchor_map);
  Eigen::Matrix3d H = plane_information(merged, plane->normal());
  const double tilt = 1 / t.tilt_sigma;
  H.diagonal() += Eigen::Vector3d(tilt * tilt, tilt * tilt, 1e-6);
  t.landmark.covariance = H.llt().solve(Eigen::Matrix3d::Identity());
}

std::optional<PlaneId> Mapper::promote(Tentative& t) {
  if (t.evidence.empty()) return std::nullopt;
  PlaneLandmark landmark = t.landmark;
  landmark.covariance.reset();  // the window's to say
  landmark.T_map_outline = plane_frame(landmark.plane_map(), landmark.anchor_map);
  landmark.outline = OutlineGrid(options_.outline_cell_m);
  const PlaneId id = graph_.add_plane(std::move(landmark));
  PlaneLandmark& plane = graph_.at(id);
  window_.add_plane(id, plane.plane_anchor, plane.anchor_map);
  bool partial = true;
  for (const auto& [keyframe, views] : t.evidence) {
    const Keyframe* from = graph_.find(keyframe);
    if (from == nullptr) continue;
    partial = partial && views.partial();
    const PlaneMomentsFactor factor{keyframe, id, factor_moments(views), ExtrinsicsId::kNone, 1.0};
    graph_.plane_moments.push_back(factor);
    window_.add(factor);
    std::vector<Eigen::Vector3d> points;
    const auto& outline_body = views.best().outline_body;
    for (const auto& p : outline_body) points.push_back(from->T_map_body * p);
    grow_outline(plane, points);
    outlines_[id].push_back({keyframe, outline_body});
    index_.insert_outline(id, points);
    if (keyframe == keyframe_) gathered_.emplace(id, views);
  }
  for (const std::int64_t track : t.tracks) link_track(track, id);
  const bool open = t.tilt_sigma > options_.prior_tilt_deg * kDegree;
  if (partial && !open) partial_.insert(id);
  if (open) {  // until the window says better: its tilt may be anything
    Eigen::Matrix<double, 9, 9> C = Eigen::Matrix<double, 9, 9>::Zero();
    C.bottomRightCorner<3, 3>() = t.landmark.covariance.value_or(Eigen::Matrix3d::Zero());
    C.bottomRightCorner<3, 3>().diagonal().array() += 1e-4;
    joint_[id] = C;
  }
  // Directions that nothing may ever measure are held, in the window and in the graph alike.
  hold(id, plane.plane_anchor, t.tilt_sigma, options_.prior_distance_m);
  t.evidence.clear();
  hold_first_floor(id);
  return id;
}

// The floor under the first pose, if `id` is that: frames of the program's contract say where.
void Mapper::hold_first_floor(PlaneId id) {
  constexpr double kMostTilt = 6 * kDegree, kMostHeight = 0.15, kMostDistance = 8;
  if (first_floor_ != PlaneId::kNone || !first_floor_map_) return;
  const PlaneLandmark& plane = graph_.at(id);
  const bool floor = plane.votes.floor > 0 && plane.votes.floor >= plane.votes.sub_dominant &&
                     plane.votes.floor >= plane.votes.obstacle;
  const Plane plane_map = plane.plane_map();
  const Eigen::Vector3d start = graph_.keyframes.front().T_map_body.translation();
  if (!floor || !(angle_between(plane_map, *first_floor_map_) < kMostTilt) ||
      !(std::abs(plane_map.rho_at(first_floor_map_->project(start))) < kMostHeight) ||
      !((plane.anchor_map - start).norm() < kMostDistance)) {
    return;
  }
  const Plane level = first_floor_map_->about(plane.anchor_map);
  if (hold(id, level, options_.first_floor_tilt_deg * kDegree, options_.first_floor_height_m)) {
    first_floor_ = id;
  }
}

// A prior on a plane, in the window and in the graph alike.
bool Mapper::hold(PlaneId id, const Plane& at, double sigma_tilt, double sigma_rho) {
  if (!window_.add_prior(id, at, sigma_tilt, sigma_rho)) return false;
  MarginalPrior prior;
  prior.planes = {id};
  prior.planes_linear = {at};
  prior.sqrt_information =
      Eigen::Vector3d(1 / sigma_tilt, 1 / sigma_tilt, 1 / sigma_rho).asDiagonal();
  prior.residual = Eigen::Vector3d::Zero();
  graph_.marginal_priors.push_back(std::move(prior));
  return true;
}

// As hold_fallen(), for the graph: lines that contradict each other enough outweigh the prior that
// a wall of level scans is upright, as one that lies in the scan has no residuals at all. It is
// stood up along the line that all of them make, and its lean held five times as firmly; its worst
// lines are outliers then.
std::size_t Mapper::stand_up_fallen() {
  constexpr double kFallen = 0.5;  // of the normal's z: 30 degrees
  constexpr double kFirmer = 5;
  const double as_new = 1 / (options_.prior_tilt_deg * kDegree);
  std::size_t stood_up = 0;
  for (MarginalPrior& prior : graph_.marginal_priors) {
    if (prior.planes.size() != 1 || prior.dimension() != 3 || !partial_.count(prior.planes[0]))
      continue;
    PlaneLandmark& plane = graph_.at(prior.planes[0]);
    const bool held = prior.sqrt_information.topLeftCorner<2, 2>().norm() > 2 * as_new;
    if (!plane.active || held || std::abs(plane.plane_anchor.normal().z()) < kFallen) continue;
    Moments merged;
    for (const PlaneMomentsFactor& f : graph_.plane_moments) {
      if (f.plane != plane.id) continue;
      merged.merge(f.moments_body.transformed(graph_.at(f.keyframe).T_map_body));
    }
    const auto line = merged.fit_line();
    if (!line) continue;
    Eigen::Vector3d n = line->direction.cross(Eigen::Vector3d::UnitZ());
    if (n.dot(prior.planes_linear[0].normal()) < 0) n = -n;
    const auto upright = Plane::from_normal_rho(n, n.dot(merged.mean() - plane.anchor_map));
    if (!upright) continue;
    plane.plane_anchor = *upright;
    prior.planes_linear[0] = *upright;
    // In the plane's tangent: which way is a lean, and which a turn.
    const Eigen::Vector2d lean = upright->tangent_basis().transpose() * Eigen::Vector3d::UnitZ();
    prior.sqrt_information.topLeftCorner<2, 2>() << as_new * kFirmer * lean.transpose(),
        as_new * Eigen::RowVector2d(-lean.y(), lean.x());
    ++stood_up;
  }
  return stood_up;
}

// ------------------------------------------------------------------------------ merging

void Mapper::remember_merge(PlaneId from) {
  MergeRecord record;
  record.landmark = graph_.at(from);
  for (const auto& f : graph_.plane_moments) {
    if (f.plane == from) record.factors.push_back(f);
  }
  record.outlines = outlines_[from];
  // Its cells are drawn anew should it come back.
  record.landmark.outline = OutlineGrid(options_.outline_cell_m);
  merges_[from] = std::move(record);
}

// The graph's part of a merge; the window's is the caller's.
void Mapper::absorb(PlaneId from, PlaneId into) {
  remember_merge(from);
  graph_.merge_planes(from, into);
  graph_.at(from).outline = OutlineGrid(options_.outline_cell_m);
  // The weak prior of the plane that went is about an anchor that is no more.
  std::erase_if(graph_.marginal_priors, [this, from](const MarginalPrior& p) {
    const bool of_it = std::find(p.planes.begin(), p.planes.end(), from) != p.planes.end();
    if (of_it) merges_.at(from).priors.push_back(p);
    return of_it;
  });
  index_.rename(from, into);
  auto& pieces = outlines_[into];
  pieces.insert(pieces.end(), outlines_[from].begin(), outlines_[from].end());
  outlines_.erase(from);
  const auto gathered = gathered_.find(from);
  if (gathered != gathered_.end()) {
    const PlaneViews views = gathered->second;
    gathered_.erase(gathered);
    const auto there = gathered_.find(into);
    if (there == gathered_.end()) {
      gathered_.emplace(into, views);
    } else {
      // The graph has a factor of each now: one goes, the other takes both.
      there->second.join(views);
      PlaneMomentsFactor* rest = drop_double(graph_.plane_moments, keyframe_, into);
      if (rest) {
        rest->moments_body = factor_moments(there->second);
        window_.set(*rest);
      }
    }
  }
  if (!partial_.count(from)) partial_.erase(into);
  partial_.erase(from);
  joint_.erase(from);
  if (from == first_floor_) {
    first_floor_ = PlaneId::kNone;
    hold_first_floor(into);
  }
}

std::vector<std::pair<PlaneId, PlaneId>> Mapper::merge_coplanar() {
  std::vector<std::pair<PlaneId, PlaneId>> merged;
  std::optional<LevelGaps> gaps;
  // Only planes seen by this keyframe can have come near another one just now.
  std::vector<PlaneId> fresh;
  for (const auto& [id, views] : gathered_) fresh.push_back(id);
  for (const PlaneId a : fresh) {
    const PlaneLandmark* plane_a = graph_.find(a);
    if (!plane_a || !plane_a->active || !joint_.count(a)) continue;
    // Compared where the one was seen just now: the other's covariance says what that is worth.
    const PlaneEvidence& seen = gathered_.at(a).best();
    const SE3& T = graph_.at(keyframe_).T_map_body;
    const Eigen::Vector3d middle = T * seen.moments_body.mean();
    const std::vector<PlaneId> near_a = near(index_, seen, T);
    const auto covariance = [this](PlaneId id) -> Eigen::Matrix3d {
      return joint_.at(id).bottomRightCorner<3, 3>();
    };
    for (const PlaneId b : window_.planes()) {
      const PlaneLandmark& plane_b = graph_.at(b);
      if (b == a || !plane_b.active || !joint_.count(b)) continue;
      if (!std::binary_search(near_a.begin(), near_a.end(), b)) continue;
      if (!one_surface(*plane_a, covariance(a), plane_b, covariance(b), middle,
                       options_.association)) {
        continue;
      }
      // Two platforms, or one and its floor.
      if (!gaps) gaps.emplace(graph_, outlines_, options_.association, oldest(window_.keyframes()));
      if (gaps->apart(a, b)) continue;
      const PlaneId from = std::max(a, b), into = std::min(a, b);
      window_.merge_planes(from, into);
      absorb(from, into);
      merged.emplace_back(from, into);
      break;
    }
  }
  return merged;
}

}  // namespace lamina
