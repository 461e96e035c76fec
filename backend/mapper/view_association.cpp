// One by one, then together, then once more from where the others put the body.
#include <lamina/backend/mapper/view_association.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <lamina/backend/association/level_separation.hpp>
#include <lamina/backend/association/lone_candidate.hpp>
#include <lamina/backend/mapper/plane_candidates.hpp>

namespace lamina {
namespace {

using Decisions = std::vector<AssociationDecision>;

// Views that could be of one plane as far as their tilt goes.
bool parallel(const PlaneEvidence& a, const PlaneEvidence& b, const AssociationOptions& options) {
  return angle_between(a.plane_body, b.plane_body) <= options.max_angle_deg * (M_PI / 180.0);
}

std::size_t decided(const Decisions& decisions) {
  return static_cast<std::size_t>(std::count_if(
      decisions.begin(), decisions.end(),
      [](const AssociationDecision& decision) { return decision.plane != PlaneId::kNone; }));
}

double misfit(const Decisions& decisions) {
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

// The views of one moment and what they are compared with.
struct Associator {
  const WorkingMap& map;
  const PlaneFormation& formation;
  const FrameViews& views;
  const std::vector<PlaneEvidence>& evidence;
  const BodyPose& predicted;
  const AssociationOptions& options;

  // Where planes of these decisions put the body.
  BodyPose placed(const Decisions& decisions) const {
    const BodyInKeyframe body = localized(map, evidence, decisions, predicted.relative);
    return {body, map.T_map_keyframe() * body.T_keyframe_body};
  }

  // Whether two views of one moment cannot be of one plane, or are level with a lower one between.
  bool separated(std::size_t i, std::size_t j, const SE3& T_map_body) const {
    return disagreement_in_view(evidence[i], evidence[j], options) > options.gate_full ||
           lower_between(evidence, i, j, T_map_body, options.surface_sigma_m);
  }

  AssociationDecision associate_one(std::size_t index, const BodyPose& body) const {
    const PlaneEvidence& view = evidence[index];
    // What the front-end followed comes first: its prediction is a scan old, not a keyframe.
    const auto same = formation.followed(map.graph, views.tracks[index]);
    if (same && map.window.contains(*same)) {
      const PlaneLandmark& plane = map.graph.at(*same);
      const AssociationCandidate c{*same, plane.plane_anchor, plane.anchor_map,
                                   carried(map.relative_covariance(*same), body.relative)};
      const auto decision =
          associate(view, body.T_map_body, std::span(&c, 1), when_followed(options));
      if (decision.plane != PlaneId::kNone) return decision;
    }
    auto near = plane_candidates(map, view, body.T_map_body);
    // Planes that left the window are taken back one by one only where the prediction is sure
    // enough to tell neighbours apart, or there are none; otherwise by several
    // (close_plane_loop()).
    std::erase_if(near, [&, all = near](const AssociationCandidate& c) {
      if (map.window.contains(c.id)) return false;
      const double sigma =
          std::sqrt(c.covariance.topLeftCorner<3, 3>().diagonal().maxCoeff() + c.covariance(8, 8));
      if (sigma < 0.2 * options.max_distance_m) return false;
      return !map.options.place.enabled || view.partial || !is_unambiguous(c, all) ||
             !(sigma < 2 * options.max_distance_m);
    });
    for (auto& c : near) c.covariance = carried(c.covariance, body.relative);
    return associate(view, body.T_map_body, near, options);
  }

  // Of two views of one moment that went to one plane and cannot be of one: the worse is let go.
  void separate(Decisions& decisions, const SE3& T_map_body) const {
    for (std::size_t i = 0; i < decisions.size(); ++i) {
      for (std::size_t j = i + 1; j < decisions.size(); ++j) {
        if (decisions[i].plane == PlaneId::kNone || decisions[i].plane != decisions[j].plane)
          continue;
        if (!separated(i, j, T_map_body)) continue;
        AssociationDecision& worse =
            decisions[decisions[i].chi_squared > decisions[j].chi_squared ? i : j];
        worse.plane = PlaneId::kNone;
        worse.reason = AssociationReason::kChiSquared;
      }
    }
  }

  // What the views of one moment are of when evidence[index] is of `candidate`: the pose follows it
  // and all that it does not run along, and what does is associated from there. nullopt: odometry
  // contradicts that, or the view does not fit even so.
  std::optional<Decisions> supposed(const Decisions& decisions, std::size_t index,
                                    const AssociationCandidate& candidate) const {
    constexpr double kGatePose = 16.8;  // 99 % of 6 degrees
    Decisions other = decisions;
    std::vector<std::size_t> along;
    for (std::size_t k = 0; k < other.size(); ++k) {
      if (!parallel(evidence[k], evidence[index], options)) continue;
      other[k].plane = PlaneId::kNone;
      if (k != index) along.push_back(k);
    }
    other[index].plane = candidate.id;
    BodyPose body = placed(other);
    for (const std::size_t k : along) other[k] = associate_one(k, body);
    AssociationCandidate c = candidate;
    c.covariance = carried(map.relative_covariance(c.id), body.relative);
    other[index] = associate(evidence[index], body.T_map_body, std::span(&c, 1), options);
    separate(other, body.T_map_body);
    if (other[index].plane == PlaneId::kNone) return std::nullopt;
    body = placed(other);
    const BodyInKeyframe& from = predicted.relative;
    const Vector6d off = (from.T_keyframe_body.inverse() * body.relative.T_keyframe_body).log();
    const Eigen::LLT<Matrix6d> llt(from.covariance);
    if (llt.info() != Eigen::Success || !(off.dot(llt.solve(off)) <= kGatePose))
      return std::nullopt;
    return other;
  }

  // Whether another view, of a known plane, runs along this one and cannot be of the same plane.
  bool beside_known(std::size_t index, const Decisions& decisions) const {
    for (std::size_t j = 0; j < evidence.size(); ++j) {
      if (decisions[j].plane != PlaneId::kNone && parallel(evidence[index], evidence[j], options) &&
          disagreement_in_view(evidence[index], evidence[j], options) > options.gate_full) {
        return true;
      }
    }
    return false;
  }

  // A pose that is off by half of what two surfaces stand apart makes the one fit the other's
  // plane, and leaves the other without. What views of one moment say of each other no pose can
  // change: where two are told apart and one of them fits nothing, the pose at which more of them
  // are of planes that are known holds (joint compatibility [Neira2001]).
  Decisions associate_together(const Decisions& decisions) const {
    Decisions best = decisions;
    for (std::size_t i = 0; i < evidence.size(); ++i) {
      if (evidence[i].partial || !missed(decisions[i]) || !beside_known(i, decisions)) continue;
      for (const auto& c : plane_candidates(map, evidence[i], predicted.T_map_body)) {
        if (!map.window.contains(c.id)) continue;
        auto other = supposed(decisions, i, c);
        if (!other) continue;
        const std::size_t more = decided(*other), most = decided(best);
        if (more > most ||
            (more == most && more > decided(decisions) && misfit(*other) < misfit(best))) {
          best = std::move(*other);
        }
      }
    }
    return best;
  }

  // Views that missed a gate, once more from where those that did not put the body.
  void associate_again(Decisions& decisions) const {
    if (decided(decisions) == 0) return;
    std::optional<BodyPose> body;
    for (std::size_t i = 0; i < decisions.size(); ++i) {
      if (evidence[i].partial || !missed(decisions[i])) continue;
      if (!body) body = placed(decisions);
      decisions[i] = associate_one(i, *body);
    }
    if (body) separate(decisions, predicted.T_map_body);
  }

  Decisions associate_all() const {
    Decisions decisions;
    for (std::size_t i = 0; i < evidence.size(); ++i) {
      decisions.push_back(associate_one(i, predicted));
    }
    separate(decisions, predicted.T_map_body);
    if (map.keyframe == KeyframeId::kNone) return decisions;
    decisions = associate_together(decisions);
    associate_again(decisions);
    return decisions;
  }

  std::vector<std::optional<std::size_t>> forming(const Decisions& decisions) const {
    auto young = formation.candidates();
    for (auto& c : young) c.covariance = carried(c.covariance, predicted.relative);
    std::vector<std::optional<std::size_t>> all;
    for (std::size_t i = 0; i < evidence.size(); ++i) {
      std::optional<std::size_t> found;
      if (decisions[i].plane == PlaneId::kNone &&
          decisions[i].reason != AssociationReason::kTooWeak &&
          decisions[i].reason != AssociationReason::kAmbiguous) {
        found = formation.match(map, evidence[i], views.tracks[i], predicted.T_map_body, young);
      }
      for (std::size_t j = 0; j < i && found; ++j) {
        if (all[j] == found && separated(j, i, predicted.T_map_body)) found.reset();
      }
      all.push_back(found);
    }
    return all;
  }
};

}  // namespace

ViewAssociation associate_views(const WorkingMap& map, const PlaneFormation& formation,
                                const FrameViews& views, const BodyPose& predicted) {
  const Associator associator{
      map, formation, views, views.evidence, predicted, map.options.association};
  ViewAssociation result{associator.associate_all(), {}};
  result.forming = associator.forming(result.decisions);
  return result;
}

}  // namespace lamina
