// The shortest way between two outlines in plan, and the uppermost surface along it.
#include <lamina/backend/association/level_separation.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include <lamina/models/checked_cast.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

constexpr double kLevel = 0.94;     // cosine: within 20 degrees of up
constexpr double kLeastGap = 0.05;  // m: nearer, nothing can be told to lie between
constexpr double kSpacing = 0.1;    // m, of points on rims
constexpr int kMostSteps = 10000;   // a kilometre
constexpr double kSigmas = 3;
constexpr int kSteps = 8;

double height_at(const Plane& plane, const Eigen::Vector2d& p) {
  return (plane.rho() - plane.normal().head<2>().dot(p)) / plane.normal().z();
}

// Middles of the cells that have a free one beside them.
std::vector<Eigen::Vector2d> rim_of(const PlaneLandmark& plane) {
  std::vector<Eigen::Vector2d> rim;
  const double size = plane.outline.cell_size();
  for (const auto& [i, j] : plane.outline.cells()) {
    const bool inside =
        plane.outline.contains_cell({i - 1, j}) && plane.outline.contains_cell({i + 1, j}) &&
        plane.outline.contains_cell({i, j - 1}) && plane.outline.contains_cell({i, j + 1});
    if (inside) continue;
    const Eigen::Vector3d p(size * (i + 0.5), size * (j + 0.5), 0);
    rim.push_back((plane.T_map_outline * p).head<2>());
  }
  return rim;
}

std::vector<Eigen::Vector2d> rim_of(const Polygon& polygon) {
  std::vector<Eigen::Vector2d> rim;
  const auto& corners = polygon.vertices();
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Eigen::Vector2d along = corners[(k + 1) % corners.size()] - corners[k];
    const int steps = to_whole(std::ceil(along.norm() / kSpacing), 1, kMostSteps);
    for (int s = 0; s < steps; ++s) rim.push_back(corners[k] + along * s / steps);
  }
  return rim;
}

std::pair<Eigen::Vector2d, Eigen::Vector2d> shortest_way(const std::vector<Eigen::Vector2d>& a,
                                                         const std::vector<Eigen::Vector2d>& b) {
  std::pair<Eigen::Vector2d, Eigen::Vector2d> best{{0, 0}, {0, 0}};
  double least = std::numeric_limits<double>::infinity();
  for (const auto& p : a) {
    for (const auto& q : b) {
      if ((q - p).squaredNorm() >= least) continue;
      least = (q - p).squaredNorm();
      best = {p, q};
    }
  }
  return best;
}

bool any_in(const std::vector<Eigen::Vector2d>& points, const LevelSheet& sheet) {
  return std::any_of(points.begin(), points.end(),
                     [&sheet](const auto& p) { return sheet.covers(p); });
}

}  // namespace

LevelSheet::LevelSheet(const Plane& plane_map, const LabelVotes& votes)
    : plane_map_(plane_map),
      ground_(votes.floor > 0 && votes.floor >= votes.sub_dominant &&
              votes.floor >= votes.obstacle) {}

std::optional<LevelSheet> LevelSheet::of(const PlaneLandmark& plane) {
  const Plane plane_map = plane.plane_map();
  if (!plane.active || plane_map.normal().z() < kLevel || plane.outline.empty()) {
    return std::nullopt;
  }
  LevelSheet sheet(plane_map, plane.votes);
  sheet.landmark_ = &plane;
  sheet.T_outline_map_ = plane.T_map_outline.inverse();
  return sheet;
}

std::optional<LevelSheet> LevelSheet::of(const PlaneEvidence& evidence, const SE3& T_map_body) {
  const Plane plane_map = T_map_body * evidence.plane_body;
  if (evidence.partial || plane_map.normal().z() < kLevel) return std::nullopt;
  std::vector<Eigen::Vector2d> flat;
  for (const auto& p : evidence.outline_body) flat.push_back((T_map_body * p).head<2>());
  auto polygon = Polygon::from_vertices(std::move(flat));
  if (!polygon) return std::nullopt;
  LevelSheet sheet(plane_map, evidence.votes);
  sheet.polygon_ = std::move(*polygon);
  return sheet;
}

std::vector<Eigen::Vector2d> LevelSheet::rim() const {
  return landmark_ ? rim_of(*landmark_) : rim_of(polygon_);
}

double LevelSheet::height(const Eigen::Vector2d& at) const { return height_at(plane_map_, at); }

bool LevelSheet::covers(const Eigen::Vector2d& at) const {
  if (!landmark_) return polygon_.contains(at);
  const Eigen::Vector3d p(at.x(), at.y(), height(at));
  return landmark_->outline.contains((T_outline_map_ * p).head<2>());
}

namespace {

// Whether along most of the shortest way from one to the other lower(top, p) holds of the uppermost
// sheet there.
bool lower_along(const LevelSheet& a, const LevelSheet& b, std::span<const LevelSheet> sheets,
                 const std::function<bool(const LevelSheet&, const Eigen::Vector2d&)>& lower) {
  if (a.ground() || b.ground()) return false;
  const auto rim_a = a.rim();
  if (any_in(rim_a, b)) return false;
  const auto rim_b = b.rim();
  if (any_in(rim_b, a)) return false;
  const auto [from, to] = shortest_way(rim_a, rim_b);
  if ((to - from).norm() < kLeastGap) return false;
  int found = 0;
  for (int k = 1; k < kSteps; ++k) {
    const Eigen::Vector2d p = from + (to - from) * k / kSteps;
    const LevelSheet* top = nullptr;
    for (const LevelSheet& sheet : sheets) {
      if (sheet.covers(p) && (!top || sheet.height(p) > top->height(p))) top = &sheet;
    }
    found += top && lower(*top, p) ? 1 : 0;
  }
  return 2 * found >= kSteps;
}

bool below(const LevelSheet& top, const Eigen::Vector2d& p, const LevelSheet& a,
           const LevelSheet& b, double least) {
  return top.height(p) + least < std::min(a.height(p), b.height(p));
}

}  // namespace

bool lower_between(const LevelSheet& a, const LevelSheet& b, std::span<const LevelSheet> sheets,
                   double surface_sigma_m) {
  return lower_along(a, b, sheets, [&](const LevelSheet& top, const Eigen::Vector2d& p) {
    return below(top, p, a, b, kSigmas * surface_sigma_m);
  });
}

bool lower_between(std::span<const PlaneEvidence> evidence, std::size_t i, std::size_t j,
                   const SE3& T_map_body, double surface_sigma_m) {
  const auto a = LevelSheet::of(evidence[i], T_map_body);
  const auto b = LevelSheet::of(evidence[j], T_map_body);
  if (!a || !b || a->ground() || b->ground()) return false;
  std::vector<LevelSheet> sheets;
  for (const PlaneEvidence& e : evidence) {
    if (auto sheet = LevelSheet::of(e, T_map_body)) sheets.push_back(std::move(*sheet));
  }
  return lower_between(*a, *b, sheets, surface_sigma_m);
}

LevelGaps::LevelGaps(const Graph& graph,
                     const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
                     const AssociationOptions& options, KeyframeId first)
    : options_(options) {
  for (const PlaneLandmark& plane : graph.planes) {
    auto sheet = LevelSheet::of(plane);
    if (!sheet) continue;
    sheet_of_[plane.id] = sheets_.size();
    ids_.push_back(plane.id);
    sheets_.push_back(std::move(*sheet));
  }
  add_views(graph, outlines, first);
}

namespace {

// Of the pieces that a keyframe saw of a plane, in plan, that which lies in `plane_map`.
std::optional<Polygon> plan_of(const std::vector<const OutlinePiece*>& pieces,
                               const SE3& T_map_body, const Plane& plane_map) {
  std::vector<Eigen::Vector2d> flat;
  double least = std::numeric_limits<double>::infinity();
  for (const OutlinePiece* piece : pieces) {
    std::vector<Eigen::Vector2d> points;
    double off = 0;
    for (const auto& p_body : piece->points_body) {
      const Eigen::Vector3d p = T_map_body * p_body;
      points.push_back(p.head<2>());
      off += std::abs(plane_map.signed_distance(p));
    }
    off /= static_cast<double>(points.size());
    if (!(off < least)) continue;
    least = off;
    flat = std::move(points);
  }
  return Polygon::from_vertices(std::move(flat));
}

// Of a view's height and slopes about its middle, without what surfaces deviate by (variances).
Eigen::Matrix3d height_covariance(const Moments& m, double rho2, double tilt2) {
  const Eigen::Matrix2d information = m.scatter().topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(information);
  const Eigen::Vector2d slopes =
      (eigen.eigenvalues().cwiseMax(1e-6).cwiseInverse().array() - tilt2).cwiseMax(0);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance(0, 0) = std::max(0.0, 1 / m.weight() - rho2);
  covariance.bottomRightCorner<2, 2>() =
      eigen.eigenvectors() * slopes.asDiagonal() * eigen.eigenvectors().transpose();
  return covariance;
}

}  // namespace

void LevelGaps::add_views(const Graph& graph,
                          const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
                          KeyframeId first) {
  // What surfaces deviate by is in every factor; a view's own noise is the rest.
  const double rho2 = std::pow(options_.surface_sigma_m, 2);
  const double tilt2 = std::pow(options_.surface_sigma_deg * M_PI / 180, 2);
  std::map<PlaneId, std::map<KeyframeId, std::vector<const OutlinePiece*>>> seen;
  for (const auto& [id, sheet] : sheet_of_) {
    const auto pieces = outlines.find(id);
    if (pieces == outlines.end()) continue;
    for (const auto& piece : pieces->second) {
      if (piece.keyframe < first || piece.points_body.size() < 3) continue;
      if (graph.find(piece.keyframe)) seen[id][piece.keyframe].push_back(&piece);
    }
  }
  for (const auto& f : graph.plane_moments) {
    if (f.keyframe < first) continue;
    const auto of_plane = seen.find(f.plane);
    if (of_plane == seen.end() || !(f.weight >= 0.5) || !(f.moments_body.weight() > 0)) continue;
    const auto here = of_plane->second.find(f.keyframe);
    if (here == of_plane->second.end()) continue;
    const SE3& T_map_body = graph.at(f.keyframe).T_map_body;
    const Moments m = f.moments_body.transformed(T_map_body);
    const auto fit = m.fit_plane(m.mean() + Eigen::Vector3d::UnitZ(), 1.0);
    if (!fit || fit->plane.normal().z() < kLevel) continue;
    const auto plan = plan_of(here->second, T_map_body, fit->plane);
    if (!plan) continue;
    views_[f.plane][f.keyframe].push_back(
        {fit->plane, m.mean().head<2>(), height_covariance(m, rho2, tilt2), *plan});
  }
}

double LevelGaps::View::variance(const Eigen::Vector2d& at) const {
  const Eigen::Vector3d arm(1, at.x() - middle.x(), at.y() - middle.y());
  return arm.dot(covariance * arm);
}

// nullopt where none of a plane's views borders on one of the other's.
std::optional<bool> LevelGaps::step(const std::vector<View>& a, const std::vector<View>& b) {
  constexpr double kBeside = 0.1;  // m: between views of two neighbours lies an image's block
  constexpr double kShare = 0.9;
  int all = 0, a_above = 0, b_above = 0;
  for (const View& view_a : a) {
    for (const View& view_b : b) {
      const bool first = view_a.plan.area() < view_b.plan.area();
      const View &small = first ? view_a : view_b, &large = first ? view_b : view_a;
      for (const auto& p : rim_of(small.plan)) {
        if (large.plan.signed_distance(p) > kBeside) continue;
        ++all;
        const double off = height_at(view_a.plane_map, p) - height_at(view_b.plane_map, p);
        const double sigma = std::sqrt(view_a.variance(p) + view_b.variance(p));
        a_above += off > kSigmas * sigma ? 1 : 0;
        b_above += off < -kSigmas * sigma ? 1 : 0;
      }
    }
  }
  if (all == 0) return std::nullopt;
  return std::max(a_above, b_above) >= kShare * all;
}

bool LevelGaps::between(PlaneId a, PlaneId b) const {
  const auto of_a = sheet_of_.find(a), of_b = sheet_of_.find(b);
  if (of_a == sheet_of_.end() || of_b == sheet_of_.end()) return false;
  const LevelSheet &sheet_a = sheets_[of_a->second], &sheet_b = sheets_[of_b->second];
  std::map<const LevelSheet*, bool> edges;  // of both towards it
  const auto has_edges = [&](const LevelSheet& top) {
    const auto [known, fresh] = edges.try_emplace(&top, false);
    const PlaneId id = ids_[static_cast<std::size_t>(&top - sheets_.data())];
    if (fresh) known->second = id != a && id != b && step(a, id) && step(b, id);
    return known->second;
  };
  return lower_along(sheet_a, sheet_b, sheets_, [&](const LevelSheet& top, const auto& p) {
    return below(top, p, sheet_a, sheet_b, kSigmas * options_.surface_sigma_m) ||
           (below(top, p, sheet_a, sheet_b, 0) && has_edges(top));
  });
}

bool LevelGaps::step(PlaneId a, PlaneId b) const {
  const auto of_a = views_.find(a), of_b = views_.find(b);
  if (of_a == views_.end() || of_b == views_.end()) return false;
  int steps = 0, none = 0;
  for (const auto& [keyframe, views] : of_a->second) {
    const auto other = of_b->second.find(keyframe);
    if (other == of_b->second.end()) continue;
    if (const auto found = step(views, other->second)) ++(*found ? steps : none);
  }
  return steps > none;
}

}  // namespace lamina
