// Which pieces touch, and the plane through all of them.
#include <lamina/backend/association/connected_ground.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

struct Piece {
  std::size_t place;  // in the evidence
  Plane plane_body;
  Polygon plan;
  Eigen::Matrix3d covariance;  // of height at the middle and the two slopes
  Eigen::Vector2d middle;
  Eigen::AlignedBox2d box = {};  // of the plan

  // Whether the plan comes this near, m.
  bool near(const Eigen::Vector2d& at, double reach) const {
    return box.squaredExteriorDistance(at) <= reach * reach && plan.signed_distance(at) <= reach;
  }
  double height(const Eigen::Vector2d& at) const {
    const Eigen::Vector3d& n = plane_body.normal();
    return (plane_body.rho() - n.head<2>().dot(at)) / n.z();
  }
  double variance(const Eigen::Vector2d& at) const {
    const Eigen::Vector3d lever(1, at.x() - middle.x(), at.y() - middle.y());
    return lever.dot(covariance * lever);
  }
};

bool is_ground(const PlaneEvidence& e, double max_slope) {
  const bool ground = e.votes.floor > 0 || e.votes.sub_dominant > 0;
  return ground && !e.partial && e.plane_body.normal().z() > std::cos(max_slope);
}

std::optional<Piece> piece_of(const PlaneEvidence& e, std::size_t place) {
  std::vector<Eigen::Vector2d> plan;
  for (const auto& p : e.outline_body) plan.push_back(p.head<2>());
  auto polygon = Polygon::from_vertices(std::move(plan));
  const Moments m = e.moments_body.discounted(e.plane_body.normal(), e.floor);
  if (!polygon || !(m.weight() > 0) || !m.mean().allFinite()) return std::nullopt;
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  H(0, 0) = m.weight();
  H.bottomRightCorner<2, 2>() = m.scatter().topLeftCorner<2, 2>();
  H.diagonal() += Eigen::Vector3d(1, 1, 1);
  Piece piece{place, e.plane_body, std::move(*polygon), H.inverse(), m.mean().head<2>()};
  for (const Eigen::Vector2d& corner : piece.plan.vertices()) piece.box.extend(corner);
  return piece;
}

std::vector<Piece> pieces_of(std::span<const PlaneEvidence> evidence, double max_slope) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    if (!is_ground(evidence[i], max_slope)) continue;
    if (auto piece = piece_of(evidence[i], i)) pieces.push_back(std::move(*piece));
  }
  return pieces;
}

// Whether two pieces touch, and along their common border neither stands above the other by more
// than noise explains.
bool touches_without_step(const Piece& a, const Piece& b, const ConnectedGroundOptions& options) {
  double squares = 0, allowed = 0;
  int count = 0;
  for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    const auto& corners = one->plan.vertices();
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Eigen::Vector2d along = corners[(k + 1) % corners.size()] - corners[k];
      const int steps =
          std::clamp(static_cast<int>(std::ceil(along.norm() / options.border_step_m)), 1, 200);
      for (int s = 0; s < steps; ++s) {
        const Eigen::Vector2d p = corners[k] + along * s / steps;
        if (!other->near(p, options.touch_m)) continue;
        const double step = one->height(p) - other->height(p);
        squares += step * step;
        allowed += 9 * (one->variance(p) + other->variance(p)) + options.step_m * options.step_m;
        ++count;
      }
    }
  }
  return count >= 4 && squares <= allowed;
}

// Places in `pieces` of what is connected with the first.
std::vector<std::size_t> connected(const std::vector<Piece>& pieces, std::size_t first,
                                   const ConnectedGroundOptions& options) {
  std::vector<std::size_t> found{first};
  std::vector<bool> taken(pieces.size(), false);
  taken[first] = true;
  for (std::size_t k = 0; k < found.size(); ++k) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (taken[i] || !touches_without_step(pieces[found[k]], pieces[i], options)) continue;
      taken[i] = true;
      found.push_back(i);
    }
  }
  return found;
}

struct Patch {
  const Moments* moments;
  std::size_t piece;  // place in the connected ones
  double variance;    // m^2, of its height
};

// What lies on the connected pieces: on none of the others, a platform's top, more closely.
std::vector<Patch> patches_on(std::span<const Moments> patches, const std::vector<Piece>& pieces,
                              const std::vector<std::size_t>& connected,
                              const ConnectedGroundOptions& options) {
  std::vector<Patch> found;
  for (const Moments& m : patches) {
    double nearest = options.off_piece_m;
    std::size_t of = pieces.size();
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      const double off = std::abs(pieces[k].plane_body.signed_distance(m.mean()));
      if (off >= nearest || !pieces[k].near(m.mean().head<2>(), options.beside_piece_m)) continue;
      nearest = off;
      of = k;
    }
    const auto place = std::find(connected.begin(), connected.end(), of);
    if (place == connected.end() || !(m.weight() > 0)) continue;
    found.push_back({&m, static_cast<std::size_t>(place - connected.begin()), 1 / m.weight()});
  }
  return found;
}

// Moments of all patches, each weighed by 1 / (its variance + roughness^2).
Moments weighted(const std::vector<Patch>& patches, double roughness) {
  Moments sum;
  for (const Patch& p : patches)
    sum.merge(p.moments->scaled(p.variance / (p.variance + roughness * roughness)));
  return sum;
}

// Less the patches' own noise.
class MeanSquare {
 public:
  void add(double off, double variance) {
    sum_ += off * off - variance;
    ++count_;
  }
  std::size_t count() const { return count_; }
  double root() const {
    return count_ > 0 ? std::sqrt(std::max(0.0, sum_ / static_cast<double>(count_))) : 0;
  }

 private:
  double sum_ = 0;
  std::size_t count_ = 0;
};

double rms_off(const std::vector<Patch>& patches, const Plane& plane) {
  MeanSquare square;
  for (const Patch& p : patches) square.add(plane.signed_distance(p.moments->mean()), p.variance);
  return square.root();
}

std::optional<double> rms_off_pieces(const std::vector<Patch>& patches,
                                     const std::vector<Piece>& pieces,
                                     const std::vector<std::size_t>& together,
                                     const ConnectedGroundOptions& options) {
  MeanSquare square;
  for (const Patch& p : patches) {
    if (p.moments->mean().head<2>().norm() > options.near_m) continue;
    const Plane& plane = pieces[together[p.piece]].plane_body;
    square.add(plane.signed_distance(p.moments->mean()), p.variance);
  }
  if (square.count() < options.min_patches) return std::nullopt;
  return square.root();
}

// One closed outline on `plane` round all pieces: from the first to each other and back along a
// line, which holds no area.
std::vector<Eigen::Vector3d> outline_of(std::span<const PlaneEvidence> evidence,
                                        const std::vector<std::size_t>& places,
                                        const Plane& plane) {
  std::vector<Eigen::Vector3d> outline = evidence[places.front()].outline_body;
  if (outline.empty()) return outline;
  const Eigen::Vector3d from = outline.back();
  for (std::size_t k = 1; k < places.size(); ++k) {
    const auto& piece = evidence[places[k]].outline_body;
    if (piece.empty()) continue;
    outline.insert(outline.end(), piece.begin(), piece.end());
    outline.push_back(piece.front());
    outline.push_back(from);
  }
  for (Eigen::Vector3d& p : outline) p = plane.project(p);
  return outline;
}

// The dominant floor, or the largest piece; none: the end.
std::size_t first_of(std::span<const PlaneEvidence> evidence, const std::vector<Piece>& pieces,
                     bool any) {
  std::size_t best = pieces.size();
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (evidence[pieces[i].place].votes.floor > 0) return i;
    if (any && (best == pieces.size() || pieces[i].plan.area() > pieces[best].plan.area()))
      best = i;
  }
  return best;
}

}  // namespace

std::optional<GroundView> connected_ground(std::span<const PlaneEvidence> evidence,
                                           std::span<const Moments> patches_body, bool any_first,
                                           const ConnectedGroundOptions& options) {
  const std::vector<Piece> pieces = pieces_of(evidence, options.max_slope_deg * M_PI / 180);
  const std::size_t first = first_of(evidence, pieces, any_first);
  if (first == pieces.size()) return std::nullopt;
  const auto together = connected(pieces, first, options);
  const std::vector<Patch> patches = patches_on(patches_body, pieces, together, options);
  if (patches.size() < options.min_patches) return std::nullopt;
  GroundView view;
  for (const std::size_t k : together) view.pieces.push_back(pieces[k].place);
  view.joined = evidence[view.pieces.front()];
  view.roughness = options.first_roughness_m;
  for (int round = 0; round < 3; ++round) {
    view.joined.moments_body = weighted(patches, view.roughness);
    const auto fit = view.joined.moments_body.fit_plane(Eigen::Vector3d::UnitZ(), 1.0);
    if (!fit) return std::nullopt;
    view.joined.plane_body = fit->plane;
    view.roughness = rms_off(patches, fit->plane);
  }
  view.joined.outline_body = outline_of(evidence, view.pieces, view.joined.plane_body);
  view.area = options.patch_m * options.patch_m * static_cast<double>(patches.size());
  view.within_pieces = rms_off_pieces(patches, pieces, together, options);
  return view;
}

void GroundWatch::add(const std::optional<GroundView>& view,
                      const ConnectedGroundOptions& options) {
  if (!options.enabled || !view || !view->within_pieces) return;
  const double kept = 1 - 1 / options.memory_views;
  views_ = kept * views_ + 1;
  within_ = kept * within_ + *view->within_pieces * *view->within_pieces;
  roughness_ = kept * roughness_ + view->roughness * view->roughness;
  const double limit = (swells_ ? options.slack : 1) * options.swell_m;
  swells_ = views_ > options.min_views && within_ > limit * limit * views_;
}

double GroundWatch::roughness() const { return views_ > 0 ? std::sqrt(roughness_ / views_) : 0; }

PlaneEvidence GroundWatch::as_one(const GroundView& view,
                                  const ConnectedGroundOptions& options) const {
  PlaneEvidence one = view.joined;
  const double places = std::max(1.0, view.area / (options.correlation_m * options.correlation_m));
  const double off = std::max(roughness(), view.roughness) / std::sqrt(places);
  one.floor.sigma_rho = std::hypot(one.floor.sigma_rho, off);
  one.floor.sigma_bend = std::hypot(one.floor.sigma_bend, off);
  return one;
}

Eigen::Vector2d GroundWatch::lift_variances(double way,
                                            const ConnectedGroundOptions& options) const {
  // Two heights of a stationary ground differ by up to the root of two of its roughness.
  const double share = std::min(1.0, way / options.correlation_m);
  const double height = roughness() * M_SQRT2 * share;
  const double slope = 2 * roughness() / options.correlation_m * M_SQRT2 * share;
  return {height * height, slope * slope};
}

}  // namespace lamina
