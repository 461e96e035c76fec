// What lies near, and not beyond a gap.
#include <lamina/backend/mapper/plane_candidates.hpp>

#include <algorithm>
#include <limits>

#include <lamina/backend/association/level_separation.hpp>
#include <lamina/backend/association/outline_gap.hpp>

namespace lamina {
namespace {

// Whether anything but strokes of scans was seen of the plane.
bool has_area(const std::map<PlaneId, std::vector<OutlinePiece>>& outlines, PlaneId id) {
  const auto pieces = outlines.find(id);
  return pieces != outlines.end() &&
         std::any_of(pieces->second.begin(), pieces->second.end(),
                     [](const OutlinePiece& piece) { return piece.points_body.size() > 2; });
}

// What lies beyond a floor that was seen between is another platform, however well the height of
// the one, carried on to there, fits it.
void drop_beyond_gaps(const WorkingMap& map, const PlaneEvidence& evidence, const SE3& T_map_body,
                      std::vector<AssociationCandidate>& near) {
  const auto here = LevelSheet::of(evidence, T_map_body);
  if (!here || here->ground()) return;
  std::vector<LevelSheet> sheets;
  std::map<PlaneId, std::size_t> sheet_of;
  for (const auto& c : near) {
    auto sheet = LevelSheet::of(map.graph.at(c.id));
    if (!sheet) continue;
    sheet_of[c.id] = sheets.size();
    sheets.push_back(std::move(*sheet));
  }
  std::erase_if(near, [&](const AssociationCandidate& c) {
    const auto sheet = sheet_of.find(c.id);
    return sheet != sheet_of.end() && lower_between(*here, sheets[sheet->second], sheets,
                                                    map.options.association.surface_sigma_m);
  });
}

}  // namespace

std::vector<AssociationCandidate> plane_candidates(const WorkingMap& map,
                                                   const PlaneEvidence& evidence,
                                                   const SE3& T_map_body) {
  constexpr double kSpacing = 0.25;  // m, of points on outlines
  std::vector<AssociationCandidate> result;
  const auto points = [&](double spacing) {
    auto all = sample_outline(evidence.outline_body, spacing);
    if (evidence.moments_body.mean().allFinite()) all.push_back(evidence.moments_body.mean());
    for (auto& p : all) p = T_map_body * p;
    return all;
  };
  // Areas join what they touch: what lies beyond a gap the refined map decides. Strokes of scans
  // are cut more often, and join strokes further away.
  const auto close = map.index.near_close(points(map.index.small_cell()));
  const auto sampled = points(kSpacing);
  for (const PlaneId id : evidence.partial ? map.index.near(points(map.index.cell())) : close) {
    const PlaneLandmark& plane = map.graph.at(id);
    if (!plane.active) continue;
    if (evidence.partial && !std::binary_search(close.begin(), close.end(), id) &&
        has_area(map.outlines, id)) {
      continue;
    }
    if (!falls_on(plane, sampled) && !beside(sampled, seen_points_map(plane), map.index.cell()))
      continue;
    result.push_back({id, plane.plane_anchor, plane.anchor_map, map.relative_covariance(id)});
  }
  drop_beyond_gaps(map, evidence, T_map_body, result);
  return result;
}

JointCovariance carried(const JointCovariance& joint, const BodyInKeyframe& body) {
  JointCovariance A = JointCovariance::Identity();
  A.topLeftCorner<6, 6>() = body.T_keyframe_body.inverse().adjoint();
  JointCovariance C = A * joint * A.transpose();
  C.topLeftCorner<6, 6>() += body.covariance;
  return C;
}

AssociationOptions when_followed(const AssociationOptions& options) {
  constexpr double kFollowedDegrees = 60;
  AssociationOptions wide = options;
  wide.max_angle_deg = std::max(options.max_angle_deg, kFollowedDegrees);
  wide.max_distance_m = std::numeric_limits<double>::infinity();
  return wide;
}

}  // namespace lamina
