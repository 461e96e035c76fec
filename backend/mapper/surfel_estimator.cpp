// Closed-form cells of floor.
#include <lamina/backend/mapper/surfel_estimator.hpp>

#include <Eigen/Cholesky>
#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

// Points (x, y, z) of weight w: sum w (z - h - s.(xy - c))^2 = |A (h, s) - b|^2 in moments.
struct HeightEquations {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
};

HeightEquations height_equations(const Moments& m, const Eigen::Vector2d& center) {
  HeightEquations e;
  const Eigen::Vector2d d = m.mean().head<2>() - center;
  Eigen::Vector3d a;
  a << 1, d;
  e.H = m.weight() * a * a.transpose();
  e.H.bottomRightCorner<2, 2>() += m.scatter().topLeftCorner<2, 2>();
  e.b = m.weight() * m.mean().z() * a;
  e.b.tail<2>() += m.scatter().block<2, 1>(0, 2);
  return e;
}

}  // namespace

std::optional<SurfelCell> solve_surfel(const Moments& evidence, const Eigen::Vector2d& center,
                                       const Plane* parent, const SurfelOptions& options) {
  if (!(evidence.weight() > 0) || !evidence.mean().allFinite() || !evidence.scatter().allFinite()) {
    return std::nullopt;
  }
  const HeightEquations own = height_equations(evidence, center);
  // z of the parent over the cell's centre, and its slopes: n.x = rho solved for z.
  Eigen::Vector3d expected = Eigen::Vector3d(evidence.mean().z(), 0, 0);
  Eigen::Vector3d information = Eigen::Vector3d(0, 1e-4, 1e-4);
  const bool held = parent != nullptr && std::abs(parent->normal().z()) > 0.5;
  if (held) {
    const Eigen::Vector3d& n = parent->normal();
    expected << (parent->rho() - n.head<2>().dot(center)) / n.z(), -n.head<2>() / n.z();
    const double tilt = 1 / (options.parent_slope * options.parent_slope);
    information << 1 / (options.parent_sigma_m * options.parent_sigma_m), tilt, tilt;
  } else {
    information.tail<2>().setConstant(1 / (options.parent_slope * options.parent_slope));
  }
  Eigen::Vector3d x = expected;
  Eigen::Matrix3d H;
  double share = 1;
  for (int round = 0; round < 4; ++round) {
    H = own.H;
    H.diagonal() += share * information;
    x = H.llt().solve(own.b + share * information.cwiseProduct(expected));
    if (!x.allFinite()) return std::nullopt;
    const double off = (x(0) - expected(0)) / options.parent_sigma_m;
    const double scale = options.parent_robust;
    if (held) share = 1 / (1 + off * off / (scale * scale));
  }
  SurfelCell cell;
  cell.height = x(0);
  cell.slope = x.tail<2>();
  cell.covariance = H.llt().solve(Eigen::Matrix3d::Identity());
  cell.evidence = evidence;
  return cell.covariance.allFinite() ? std::optional(cell) : std::nullopt;
}

void SurfelEvidence::add(KeyframeId keyframe, const Moments& m) {
  if (!(m.weight() > 0) || !m.mean().allFinite() || !m.scatter().allFinite()) return;
  evidence_[keyframe][square_of(m.mean())].merge(m);
}

SurfelEvidence::Square SurfelEvidence::square_of(const Eigen::Vector3d& point) const {
  Square square{};
  for (int k = 0; k < 3; ++k) {
    const double c = std::floor(point(k) / cell_);
    square[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(std::clamp(c, -1e9, 1e9));
  }
  return square;
}

void SurfelEvidence::condense(const Graph& graph, const std::vector<KeyframeId>& keyframes,
                              double radius_m) {
  const Eigen::Vector3d half_up(0, 0, 0.5 * cell_);  // a floor at z = 0 is one level, not two
  std::map<Square, std::pair<KeyframeId, Square>> holder_of;  // by cell of the map
  std::map<KeyframeId, SE3> T_holder_map;
  for (const KeyframeId id : keyframes) {
    const Keyframe* keyframe = graph.find(id);
    const auto it = evidence_.find(id);
    if (keyframe == nullptr || it == evidence_.end()) continue;
    const auto squares = std::move(it->second);
    evidence_.erase(it);
    const SE3& T_map_body = keyframe->T_map_body;
    const SE3 T_body_map = T_map_body.inverse();
    KeyframeId own = id;
    double least = radius_m;
    for (const auto& [holder, T] : T_holder_map) {
      const double off = (T * T_map_body.translation()).norm();
      if (off >= least) continue;
      least = off;
      own = holder;
    }
    if (own == id) T_holder_map.emplace(id, T_body_map);
    for (const auto& [square, moments] : squares) {
      const Moments moments_map = moments.transformed(T_map_body);
      const Square cell = square_of(moments_map.mean() + half_up);
      const auto known = holder_of.find(cell);
      if (known != holder_of.end()) {
        const auto& [holder, place] = known->second;
        evidence_[holder][place].merge(
            holder == id ? moments : moments_map.transformed(T_holder_map.at(holder)));
        continue;
      }
      const Moments moments_own =
          own == id ? moments : moments_map.transformed(T_holder_map.at(own));
      const Square place = own == id ? square : square_of(moments_own.mean());
      evidence_[own][place].merge(moments_own);
      holder_of.emplace(cell, std::pair(own, place));
    }
  }
}

void SurfelEvidence::append(const SurfelEvidence& other, std::int64_t keyframe_offset) {
  LAMINA_CHECK(other.cell_ == cell_);
  for (const auto& [keyframe, squares] : other.evidence_) {
    const auto id = static_cast<KeyframeId>(static_cast<std::int64_t>(keyframe) + keyframe_offset);
    for (const auto& [square, moments] : squares) evidence_[id][square].merge(moments);
  }
}

void SurfelEvidence::transfer(KeyframeId from, KeyframeId into, const SE3& T_into_from) {
  const auto it = evidence_.find(from);
  if (it == evidence_.end() || from == into) return;
  const auto squares = std::move(it->second);
  evidence_.erase(it);
  for (const auto& [square, moments] : squares) add(into, moments.transformed(T_into_from));
}

SurfelEvidence SurfelEvidence::moved(const SE3& T_new_old) const {
  SurfelEvidence all(cell_);
  for_each([&](KeyframeId keyframe, const Moments& moments_body) {
    all.add(keyframe, moments_body.transformed(T_new_old));
  });
  return all;
}

std::size_t SurfelEvidence::size() const {
  std::size_t sum = 0;
  for (const auto& [keyframe, squares] : evidence_) sum += squares.size();
  return sum;
}

double SurfelEvidence::reach(KeyframeId keyframe) const {
  const auto it = evidence_.find(keyframe);
  double farthest = 0;
  if (it == evidence_.end()) return farthest;
  for (const auto& [square, moments] : it->second)
    farthest = std::max(farthest, moments.mean().norm());
  return farthest;
}

std::vector<KeyframeId> SurfelEvidence::keyframes() const {
  std::vector<KeyframeId> result;
  for (const auto& [keyframe, squares] : evidence_) result.push_back(keyframe);
  return result;
}

namespace {

// Adds to the level of its cell whose evidence is at this height, or the next free one.
void add_at_height(SurfelFloor& floor, const Moments& moments, double level_gap_m) {
  SurfelFloor::Key key = floor.key_of(moments.mean());
  while (const SurfelCell* there = floor.find(key)) {
    if (std::abs(there->evidence.mean().z() - moments.mean().z()) <= level_gap_m) break;
    ++key.level;
  }
  floor.at_or_new(key).evidence.merge(moments);
}

}  // namespace

const PlaneLandmark* parent_of(const Eigen::Vector3d& x,
                               const std::vector<const PlaneLandmark*>& planes, double farthest) {
  const PlaneLandmark* parent = nullptr;
  double nearest = farthest;
  for (const PlaneLandmark* plane : planes) {
    const double off = std::abs(plane->plane_anchor.signed_distance(x - plane->anchor_map));
    if (off >= nearest) continue;
    if (!plane->outline.contains((plane->T_map_outline.inverse() * x).head<2>())) continue;
    parent = plane;
    nearest = off;
  }
  return parent;
}

SurfelFloor SurfelEvidence::solve(const Graph& graph, const SurfelOptions& options) const {
  SurfelFloor floor(options.cell_m);
  for (const auto& [id, squares] : evidence_) {
    const Keyframe* keyframe = graph.find(id);
    if (keyframe == nullptr) continue;
    for (const auto& [square, moments_body] : squares) {
      add_at_height(floor, moments_body.transformed(keyframe->T_map_body), options.level_gap_m);
    }
  }
  std::vector<const PlaneLandmark*> parents;
  for (const auto& plane : graph.planes) {
    if (plane.active && plane.plane_anchor.normal().z() > 0.5) parents.push_back(&plane);
  }
  std::vector<SurfelFloor::Key> unsolved;
  for (auto& [key, cell] : floor.cells()) {
    const PlaneLandmark* parent = parent_of(cell.evidence.mean(), parents, options.level_gap_m);
    Plane plane_map;
    if (parent) plane_map = parent->plane_map();
    const auto solved =
        solve_surfel(cell.evidence, floor.center_of(key), parent ? &plane_map : nullptr, options);
    if (!solved) {
      unsolved.push_back(key);
      continue;
    }
    cell = *solved;
    cell.parent_plane = parent ? static_cast<int>(parent->id) : -1;
  }
  for (const auto& key : unsolved) floor.cells().erase(key);
  return floor;
}

}  // namespace lamina
