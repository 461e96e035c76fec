// Which plane each observation is of: candidates, what the front-end followed, planes in the
// making.
#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include <lamina/backend/association/level_separation.hpp>
#include <lamina/backend/association/lone_candidate.hpp>
#include <lamina/backend/association/outline_gap.hpp>
#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/backend/mapper/mapper_step.hpp>

namespace lamina {

namespace {
constexpr double kDegree = M_PI / 180.0;
constexpr double kSpacing = 0.25;  // m, of points on outlines
}  // namespace

AssociationOptions followed(const AssociationOptions& options) {
  constexpr double kFollowedDegrees = 60;
  AssociationOptions wide = options;
  wide.max_angle_deg = std::max(options.max_angle_deg, kFollowedDegrees);
  wide.max_distance_m = std::numeric_limits<double>::infinity();
  return wide;
}

Eigen::Matrix<double, 9, 9> Mapper::relative_covariance(PlaneId id) const {
  const auto known = joint_.find(id);
  if (known != joint_.end()) return known->second;
  // Not in the window at its last solution: what is known of both apart.
  Eigen::Matrix<double, 9, 9> C = Eigen::Matrix<double, 9, 9>::Zero();
  C.topLeftCorner<6, 6>() = keyframe_covariance_;
  const PlaneLandmark& plane = graph_.at(id);
  if (window_.contains(id)) {
    C.topLeftCorner<6, 6>().setZero();  // new: it started from this keyframe
    C.bottomRightCorner<3, 3>().diagonal() << 1e-4, 1e-4, 1e-4;
  } else if (plane.covariance) {
    C.bottomRightCorner<3, 3>() = *plane.covariance;
  }
  return C;
}

namespace {

// From the keyframe's pose and the plane to the body's pose and the plane.
Eigen::Matrix<double, 9, 9> carried(const Eigen::Matrix<double, 9, 9>& joint,
                                    const SE3& T_keyframe_body, const Matrix6d& relative) {
  Eigen::Matrix<double, 9, 9> A = Eigen::Matrix<double, 9, 9>::Identity();
  A.topLeftCorner<6, 6>() = T_keyframe_body.inverse().adjoint();
  Eigen::Matrix<double, 9, 9> C = A * joint * A.transpose();
  C.topLeftCorner<6, 6>() += relative;
  return C;
}

// Whether anything but strokes of scans was seen of the plane.
bool has_area(const std::map<PlaneId, std::vector<OutlinePiece>>& outlines, PlaneId id) {
  const auto pieces = outlines.find(id);
  return pieces != outlines.end() &&
         std::any_of(pieces->second.begin(), pieces->second.end(),
                     [](const OutlinePiece& piece) { return piece.points_body.size() > 2; });
}

}  // namespace

std::vector<AssociationCandidate> Mapper::candidates(const PlaneEvidence& evidence,
                                                     const SE3& T_map_body) {
  std::vector<AssociationCandidate> result;
  const auto points = [&](double spacing) {
    auto all = sample_outline(evidence.outline_body, spacing);
    if (evidence.moments_body.mean().allFinite()) all.push_back(evidence.moments_body.mean());
    for (auto& p : all) p = T_map_body * p;
    return all;
  };
  // Areas join what they touch: what lies beyond a gap the refined map decides. Strokes of scans
  // are cut more often, and join strokes further away.
  const auto close = index_.near_close(points(index_.small_cell()));
  const auto sampled = points(kSpacing);
  for (const PlaneId id : evidence.partial ? index_.near(points(index_.cell())) : close) {
    const PlaneLandmark& plane = graph_.at(id);
    if (!plane.active) continue;
    if (evidence.partial && !std::binary_search(close.begin(), close.end(), id) &&
        has_area(outlines_, id)) {
      continue;
    }
    if (!falls_on(plane, sampled) && !beside(sampled, seen_points_map(plane), index_.cell()))
      continue;
    result.push_back({id, plane.plane_anchor, plane.anchor_map, relative_covariance(id)});
  }
  drop_beyond_gaps(evidence, T_map_body, result);
  return result;
}

// What lies beyond a floor that was seen between is another platform, however well the height of
// the one, carried on to there, fits it.
void Mapper::drop_beyond_gaps(const PlaneEvidence& evidence, const SE3& T_map_body,
                              std::vector<AssociationCandidate>& near) const {
  const auto here = LevelSheet::of(evidence, T_map_body);
  if (!here || here->ground()) return;
  std::vector<LevelSheet> sheets;
  std::map<PlaneId, std::size_t> sheet_of;
  for (const auto& c : near) {
    auto sheet = LevelSheet::of(graph_.at(c.id));
    if (!sheet) continue;
    sheet_of[c.id] = sheets.size();
    sheets.push_back(std::move(*sheet));
  }
  std::erase_if(near, [&](const AssociationCandidate& c) {
    const auto sheet = sheet_of.find(c.id);
    return sheet != sheet_of.end() && lower_between(*here, sheets[sheet->second], sheets,
                                                    options_.association.surface_sigma_m);
  });
}

std::vector<AssociationCandidate> Mapper::tentative_candidates(const SE3&) const {
  std::vector<AssociationCandidate> result;
  for (std::size_t i = 0; i < tentatives_.size(); ++i) {
    const PlaneLandmark& plane = tentatives_[i].landmark;
    Eigen::Matrix<double, 9, 9> C = Eigen::Matrix<double, 9, 9>::Zero();
    if (plane.covariance) C.bottomRightCorner<3, 3>() = *plane.covariance;
    result.push_back({static_cast<PlaneId>(i), plane.plane_anchor, plane.anchor_map, C});
  }
  return result;
}

namespace {

// Whether an observation comes within `reach` to two of anything that was seen of a plane in the
// making. Strokes may be further away from strokes.
bool touches(const std::map<KeyframeId, PlaneViews>& seen, const PlaneEvidence& evidence,
             const SE3& T_map_body, const Graph& graph, double reach) {
  const bool strokes =
      std::all_of(seen.begin(), seen.end(), [](const auto& one) { return one.second.partial(); });
  if (evidence.partial && strokes) return true;
  PlaneIndex places(reach);
  const auto sampled = [](const std::vector<Eigen::Vector3d>& outline, const SE3& T,
                          double spacing) {
    std::vector<Eigen::Vector3d> all = sample_outline(outline, spacing);
    for (auto& p : all) p = T * p;
    return all;
  };
  places.insert(PlaneId(0), sampled(evidence.outline_body, T_map_body, reach));
  bool near = false;
  std::vector<Eigen::Vector3d> there;
  for (const auto& [id, one] : seen) {
    const Keyframe* keyframe = graph.find(id);
    if (!keyframe) continue;
    const auto& outline = one.best().outline_body;
    near = near || !places.near(sampled(outline, keyframe->T_map_body, reach)).empty();
    const auto more = sampled(outline, keyframe->T_map_body, kSpacing);
    there.insert(there.end(), more.begin(), more.end());
  }
  return near && beside(sampled(evidence.outline_body, T_map_body, kSpacing), there, 2 * reach);
}

// Whether two views of one moment cannot be of one plane, or are level with a lower one between.
bool separated(std::span<const PlaneEvidence> evidence, std::size_t i, std::size_t j,
               const SE3& T_map_body, const AssociationOptions& options) {
  return disagreement_in_view(evidence[i], evidence[j], options) > options.gate_full ||
         lower_between(evidence, i, j, T_map_body, options.surface_sigma_m);
}

}  // namespace

std::optional<PlaneId> Mapper::followed_plane(std::int64_t track) const {
  const auto link = tracks_.find(track);
  if (track < 0 || link == tracks_.end()) return std::nullopt;
  const PlaneLandmark* plane = graph_.find(link->second.plane);
  while (plane && !plane->active && plane->merged_into != PlaneId::kNone) {
    plane = graph_.find(plane->merged_into);
  }
  if (!plane || !plane->active) return std::nullopt;
  return plane->id;
}

void Mapper::link_track(std::int64_t track, PlaneId plane) {
  if (track >= 0) tracks_[track] = {plane, keyframe_};
}

AssociationDecision Mapper::associate_one(std::size_t index, const Step& step) {
  const PlaneEvidence& evidence = step.evidence[index];
  const auto here = [&](AssociationCandidate& c) {
    c.covariance = carried(c.covariance, step.estimate.T_keyframe_body, step.estimate.covariance);
  };
  // What the front-end followed comes first: its prediction is a scan old, not a keyframe.
  const auto same = followed_plane(step.tracks[index]);
  if (same && window_.contains(*same)) {
    const PlaneLandmark& plane = graph_.at(*same);
    AssociationCandidate c{*same, plane.plane_anchor, plane.anchor_map, relative_covariance(*same)};
    here(c);
    const auto decision =
        associate(evidence, step.T_map_body, std::span(&c, 1), followed(options_.association));
    if (decision.plane != PlaneId::kNone) return decision;
  }
  auto near = candidates(evidence, step.T_map_body);
  // Planes that left the window are taken back one by one only where the prediction is sure
  // enough to tell neighbours apart, or there are none; otherwise by several (recognise()).
  std::erase_if(near, [&, all = near](const AssociationCandidate& c) {
    if (window_.contains(c.id)) return false;
    const double sigma =
        std::sqrt(c.covariance.topLeftCorner<3, 3>().diagonal().maxCoeff() + c.covariance(8, 8));
    if (sigma < 0.2 * options_.association.max_distance_m) return false;
    return !options_.place.enabled || evidence.partial || !is_unambiguous(c, all) ||
           !(sigma < 2 * options_.association.max_distance_m);
  });
  for (auto& c : near) here(c);
  return associate(evidence, step.T_map_body, near, options_.association);
}

// The plane in the making that the evidence is of.
std::optional<std::size_t> Mapper::forming_plane(
    std::size_t index, const Step& step, const std::vector<AssociationCandidate>& young) const {
  const PlaneEvidence& evidence = step.evidence[index];
  const std::int64_t track = step.tracks[index];
  for (std::size_t i = 0; i < tentatives_.size(); ++i) {
    if (track < 0 || !tentatives_[i].tracks.count(track)) continue;
    const auto match = associate(evidence, step.T_map_body, std::span(&young[i], 1),
                                 followed(options_.association));
    if (match.plane != PlaneId::kNone) return i;
  }
  const auto within = [&](std::vector<AssociationCandidate> near, double reach) {
    std::erase_if(near, [&](const AssociationCandidate& c) {
      return !touches(tentatives_[static_cast<std::size_t>(c.id)].evidence, evidence,
                      step.T_map_body, graph_, reach);
    });
    return near;
  };
  const std::vector<AssociationCandidate> near = within(young, index_.small_cell());
  // What was seen at this place comes before what may go on to here.
  constexpr double kHere = 0.1;  // m
  if (near.size() > 1 && !evidence.partial) {
    const auto match =
        associate(evidence, step.T_map_body, within(near, kHere), options_.association);
    if (match.plane != PlaneId::kNone) return static_cast<std::size_t>(match.plane);
  }
  const auto match = associate(evidence, step.T_map_body, near, options_.association);
  if (match.plane == PlaneId::kNone) return std::nullopt;
  return static_cast<std::size_t>(match.plane);
}

void Mapper::part_what_one_view_tells_apart(Step& step) const {
  auto& decisions = step.result.decisions;
  for (std::size_t i = 0; i < decisions.size(); ++i) {
    for (std::size_t j = i + 1; j < decisions.size(); ++j) {
      if (decisions[i].plane == PlaneId::kNone || decisions[i].plane != decisions[j].plane)
        continue;
      if (!separated(step.evidence, i, j, step.T_map_body, options_.association)) continue;
      AssociationDecision& worse =
          decisions[decisions[i].chi_squared > decisions[j].chi_squared ? i : j];
      worse.plane = PlaneId::kNone;
      worse.reason = AssociationReason::kChiSquared;
    }
  }
}

namespace {

// Views that could be of one plane as far as their tilt goes.
bool parallel(const PlaneEvidence& a, const PlaneEvidence& b, const AssociationOptions& options) {
  return angle_between(a.plane_body, b.plane_body) <= options.max_angle_deg * kDegree;
}

std::size_t decided(const std::vector<AssociationDecision>& decisions) {
  return static_cast<std::size_t>(std::count_if(
      decisions.begin(), decisions.end(),
      [](const AssociationDecision& decision) { return decision.plane != PlaneId::kNone; }));
}

double misfit(const std::vector<AssociationDecision>& decisions) {
  double sum = 0;
  for (const AssociationDecision& decision : decisions) {
    if (decision.plane != PlaneId::kNone) sum += decision.chi_squared;
  }
  return sum;
}

// Missed by a gate, not for want of a candidate.
bool missed(const AssociationDecision& decision) {
  return decision.plane == PlaneId::kNone && (decision.reason == AssociationReason::kDistance ||
                                              decision.reason == AssociationReason::kChiSquared);
}

}  // namespace

// What the views of one moment are of when evidence[index] is of `candidate`: the pose follows it
// and all that it does not run along, and what does is associated from there. nullopt: odometry
// contradicts that, or the view does not fit even so.
std::optional<std::vector<AssociationDecision>> Mapper::supposed(
    const Step& step, std::size_t index, const AssociationCandidate& candidate) {
  constexpr double kGatePose = 16.8;  // 99 % of 6 degrees
  Step other = step;
  auto& decisions = other.result.decisions;
  std::vector<std::size_t> along;
  for (std::size_t k = 0; k < decisions.size(); ++k) {
    if (!parallel(step.evidence[k], step.evidence[index], options_.association)) continue;
    decisions[k].plane = PlaneId::kNone;
    if (k != index) along.push_back(k);
  }
  decisions[index].plane = candidate.id;
  const auto follow = [&] {
    other.estimate = located(step.estimate, other);
    other.T_map_body = graph_.at(keyframe_).T_map_body * other.estimate.T_keyframe_body;
  };
  follow();
  for (const std::size_t k : along) decisions[k] = associate_one(k, other);
  AssociationCandidate c = candidate;
  c.covariance =
      carried(relative_covariance(c.id), other.estimate.T_keyframe_body, other.estimate.covariance);
  decisions[index] =
      associate(step.evidence[index], other.T_map_body, std::span(&c, 1), options_.association);
  part_what_one_view_tells_apart(other);
  if (decisions[index].plane == PlaneId::kNone) return std::nullopt;
  follow();
  const Vector6d off =
      (step.estimate.T_keyframe_body.inverse() * other.estimate.T_keyframe_body).log();
  const Eigen::LLT<Matrix6d> llt(step.estimate.covariance);
  if (llt.info() != Eigen::Success || !(off.dot(llt.solve(off)) <= kGatePose)) return std::nullopt;
  return decisions;
}

// A pose that is off by half of what two surfaces stand apart makes the one fit the other's plane,
// and leaves the other without. What views of one moment say of each other no pose can change:
// where two are told apart and one of them fits nothing, the pose at which more of them are of
// planes that are known holds (joint compatibility [Neira2001]).
void Mapper::associate_together(Step& step) {
  if (keyframe_ == KeyframeId::kNone) return;
  const auto& options = options_.association;
  auto best = step.result.decisions;
  for (std::size_t i = 0; i < step.evidence.size(); ++i) {
    const PlaneEvidence& evidence = step.evidence[i];
    if (evidence.partial || !missed(step.result.decisions[i])) continue;
    bool observed = false;
    for (std::size_t j = 0; j < step.evidence.size() && !observed; ++j) {
      observed = step.result.decisions[j].plane != PlaneId::kNone &&
                 parallel(evidence, step.evidence[j], options) &&
                 disagreement_in_view(evidence, step.evidence[j], options) > options.gate_full;
    }
    if (!observed) continue;
    for (const AssociationCandidate& c : candidates(evidence, step.T_map_body)) {
      if (!window_.contains(c.id)) continue;
      auto other = supposed(step, i, c);
      if (!other) continue;
      const std::size_t more = decided(*other), most = decided(best);
      if (more > most || (more == most && more > decided(step.result.decisions) &&
                          misfit(*other) < misfit(best))) {
        best = std::move(*other);
      }
    }
  }
  step.result.decisions = std::move(best);
}

// Views that missed a gate, once more from where those that did not put the body.
void Mapper::look_again(Step& step) {
  auto& decisions = step.result.decisions;
  if (keyframe_ == KeyframeId::kNone || decided(decisions) == 0) return;
  std::optional<Step> placed;
  for (std::size_t i = 0; i < decisions.size(); ++i) {
    if (step.evidence[i].partial || !missed(decisions[i])) continue;
    if (!placed) {
      placed.emplace(step);
      placed->estimate = located(step.estimate, step);
      placed->T_map_body = graph_.at(keyframe_).T_map_body * placed->estimate.T_keyframe_body;
    }
    decisions[i] = associate_one(i, *placed);
  }
  if (placed) part_what_one_view_tells_apart(step);
}

void Mapper::associate_all(Step& step) {
  auto young = tentative_candidates(step.T_map_body);
  for (auto& c : young) {
    c.covariance = carried(c.covariance, step.estimate.T_keyframe_body, step.estimate.covariance);
  }
  for (std::size_t i = 0; i < step.evidence.size(); ++i) {
    step.result.decisions.push_back(associate_one(i, step));
  }
  part_what_one_view_tells_apart(step);
  associate_together(step);
  look_again(step);
  for (std::size_t i = 0; i < step.evidence.size(); ++i) {
    const AssociationDecision& decision = step.result.decisions[i];
    std::optional<std::size_t> forming;
    if (decision.plane == PlaneId::kNone && decision.reason != AssociationReason::kTooWeak &&
        decision.reason != AssociationReason::kAmbiguous) {
      forming = forming_plane(i, step, young);
    }
    for (std::size_t j = 0; j < i && forming; ++j) {
      if (step.tentative[j] == forming &&
          separated(step.evidence, j, i, step.T_map_body, options_.association)) {
        forming.reset();
      }
    }
    step.tentative.push_back(forming);
  }
}

}  // namespace lamina
