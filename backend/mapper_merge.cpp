// After the whole graph is refined: planes that turn out to be one are merged, planes that nothing
// supports any more leave, outlines are drawn anew.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <lamina/backend/mapper.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;

// What refined poses are still wrong by among each other, 1-sigma, over the extent of one view.
constexpr double kPoseSigma = 0.006;          // m
constexpr double kPoseTilt = 0.15 * kDegree;  // rad
constexpr double kGate = 11.3;                // 3 degrees of freedom, 99 %
constexpr double kFewViews = 6;               // frames: too few to say there are two planes
constexpr double kFewShare = 0.02;            // or this share of the other plane's
constexpr double kThin = 0.03;                // m: how far such views may be off all over
constexpr double kThinAngle = 5 * kDegree;
constexpr double kCovered = 0.6;  // of their outline lies in the other's

// All that the refined graph says of a plane: its evidence in map axes about its anchor.
struct Evidence {
  Moments anchor;  // weights as the refiner left them
  int views = 0;
};

std::map<PlaneId, Evidence> gather_evidence(const Graph& graph) {
  std::map<PlaneId, Evidence> all;
  for (const auto& f : graph.plane_moments) {
    if (f.weight < 0.5) continue;
    const PlaneLandmark& plane = graph.at(f.plane);
    if (!plane.active) continue;
    const SE3& T = graph.at(f.keyframe).T_map_body;
    Evidence& evidence = all[f.plane];
    evidence.anchor.merge(
        f.moments_body.transformed(SE3(T.so3(), T.translation() - plane.anchor_map)));
    ++evidence.views;
  }
  return all;
}

// Covariance of the plane's (tilt, tilt, rho) about `middle_map` in its own tangent.
Eigen::Matrix3d covariance_at(const PlaneLandmark& plane, const Evidence& evidence,
                              const Eigen::Vector3d& middle_map, double prior_tilt) {
  const Matrix32d B = plane.plane_anchor.tangent_basis();
  const Moments& m = evidence.anchor;
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  H.topLeftCorner<2, 2>() = B.transpose() * m.scatter() * B;
  Eigen::Vector3d along;
  along << B.transpose() * m.mean(), -1;
  H += m.weight() * along * along.transpose();
  H.diagonal() +=
      Eigen::Vector3d(1 / (prior_tilt * prior_tilt), 1 / (prior_tilt * prior_tilt), 1e-6);
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.bottomLeftCorner<1, 2>() = -(middle_map - plane.anchor_map).transpose() * B;
  return J * H.llt().solve(Eigen::Matrix3d::Identity()) * J.transpose();
}

// Share of `small`'s outline that lies in `large`'s, and how far from its plane at most.
struct Cover {
  double share = 0, farthest = 0;
};

Cover cover_of(const PlaneLandmark& small, const PlaneLandmark& large) {
  Cover cover;
  const auto cells = small.outline.cells();
  if (cells.size() == 0) return cover;
  const double cell = small.outline.cell_size();
  const SE3 T_large_map = large.T_map_outline.inverse();
  std::size_t inside = 0;
  for (const auto& [i, j] : cells) {
    const Eigen::Vector3d p =
        small.T_map_outline * Eigen::Vector3d((i + 0.5) * cell, (j + 0.5) * cell, 0);
    const Eigen::Vector3d q = T_large_map * p;
    inside += large.outline.contains(q.head<2>()) ? 1 : 0;
    cover.farthest = std::max(cover.farthest, std::abs(q.z()));
  }
  cover.share = static_cast<double>(inside) / static_cast<double>(cells.size());
  return cover;
}

}  // namespace

// Two planes are one when what is known of both where they meet agrees and they lie side by side:
// the estimates' chi-squared decides. Some few views off a large plane that was seen there too are
// clutter of its own noise (a bend of the image, a grazing view) and join it: the refiner judges
// them again. Every merge can be undone.
std::vector<std::pair<PlaneId, PlaneId>> Mapper::merge_refined() {
  std::vector<std::pair<PlaneId, PlaneId>> merged;
  auto evidence = gather_evidence(graph_);
  std::vector<PlaneId> order;  // small ones first: they look for a larger one
  for (const auto& [id, e] : evidence) order.push_back(id);
  std::stable_sort(order.begin(), order.end(), [&](PlaneId a, PlaneId b) {
    return evidence.at(a).views < evidence.at(b).views;
  });
  // The mapper's own index reaches up to three gaps.
  PlaneIndex index(options_.association.max_gap_m / 2);
  std::map<PlaneId, std::vector<Eigen::Vector3d>> samples;
  for (const PlaneId id : order) {
    auto& points = samples[id];
    for (const auto& piece : outlines_[id]) {
      const Keyframe* keyframe = graph_.find(piece.keyframe);
      if (!keyframe) continue;
      std::vector<Eigen::Vector3d> outline;
      for (const auto& p : piece.points_body) outline.push_back(keyframe->T_map_body * p);
      const auto more = sample_outline(outline, index.cell());
      points.insert(points.end(), more.begin(), more.end());
    }
    index.insert(id, points);
  }
  const double surface = options_.association.surface_sigma_m;
  const double surface_tilt = options_.association.surface_sigma_deg * kDegree;
  const double prior = options_.prior_tilt_deg * kDegree;
  for (const PlaneId a : order) {
    const PlaneLandmark& small = graph_.at(a);
    const Eigen::Vector3d middle = evidence.at(a).anchor.mean() + small.anchor_map;
    std::optional<PlaneId> best;
    double best_chi = kGate;
    for (const PlaneId b : index.near(samples.at(a))) {
      const PlaneLandmark& large = graph_.at(b);
      if (a == b || !large.active || !evidence.count(b)) continue;
      if (evidence.at(b).views < evidence.at(a).views ||
          (evidence.at(b).views == evidence.at(a).views && b > a)) {
        continue;
      }
      const double angle = angle_between(small.plane_anchor, large.plane_anchor);
      if (angle > kThinAngle) continue;
      const Eigen::Vector3d off =
          small.plane_map().about(middle).boxminus(large.plane_map().about(middle));
      Eigen::Matrix3d C = covariance_at(small, evidence.at(a), middle, prior) +
                          covariance_at(large, evidence.at(b), middle, prior);
      const double rho = std::hypot(surface, kPoseSigma),
                   tilt = std::hypot(surface_tilt, kPoseTilt);
      C.diagonal() += Eigen::Vector3d(tilt * tilt, tilt * tilt, rho * rho);
      double chi = off.dot(C.llt().solve(off));
      // However unsure, planes this far apart are not made one: a slab lies on its floor.
      if (std::abs(off.z()) > 5 * surface) chi = kGate;
      if (!(chi < kGate)) {
        const bool few =
            evidence.at(a).views <= std::max(kFewViews, kFewShare * evidence.at(b).views);
        if (!few || std::abs(off.z()) > kThin) continue;
        const Cover cover = cover_of(small, large);
        if (cover.share < kCovered || cover.farthest > kThin) continue;
        chi = kGate * (1 - 1e-6);
      }
      if (chi >= best_chi) continue;
      best_chi = chi;
      best = b;
    }
    if (!best) continue;
    const PlaneId into = *best;
    if (window_.contains(a)) {
      if (window_.contains(into)) {
        window_.merge_planes(a, into);
      } else {
        window_.rename_plane(a, into);
        window_.set_anchor(into, graph_.at(into).anchor_map);
      }
    }
    absorb(a, into);
    index.rename(a, into);
    // In the frame of the plane that stays.
    auto& kept = evidence.at(into);
    const Eigen::Vector3d shift = small.anchor_map - graph_.at(into).anchor_map;
    kept.anchor.merge(evidence.at(a).anchor.transformed(SE3::from_translation(shift)));
    kept.views += evidence.at(a).views;
    remake_outline(graph_.at(into), outlines_[into], graph_, options_.outline_cell_m);
    merged.emplace_back(a, into);
  }
  return merged;
}

// Planes of which the refiner believed no frame: their views were of something else.
std::size_t Mapper::drop_unsupported() {
  const auto evidence = gather_evidence(graph_);
  std::size_t gone = 0;
  for (auto& plane : graph_.planes) {
    if (!plane.active || evidence.count(plane.id) || window_.contains(plane.id)) continue;
    plane.active = false;
    index_.remove(plane.id);
    ++gone;
  }
  return gone;
}

}  // namespace lamina
