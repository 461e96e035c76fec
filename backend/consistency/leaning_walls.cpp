// Outlines of few sightings against planes of many.
#include <lamina/backend/consistency/leaning_walls.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lamina {
namespace {

constexpr double kUpright = 0.5;              // |n.z| below
constexpr double kArea = 1;                   // m^2; looks take back what is smaller
constexpr double kLean = 0.05;                // |n.z| from
constexpr std::int64_t kMoreOften = 4;        // times
constexpr double kAlike = 0.93969262;         // cosine of 20 degrees
constexpr double kBeside = 0.2;               // m that it may reach over the wall's borders
constexpr double kFarthest = 0.5;             // m before or behind the wall
constexpr double kNear = 0.02;                // m: neither before nor behind
constexpr double kOver = 0.6, kAside = 0.15;  // shares of its outline's corners

bool upright(const MapPlane& plane) {
  return std::abs(plane.plane_map.normal().z()) < kUpright && !plane.outlines_map.empty();
}

// What a wall covers, as a rectangle of its own.
class Front {
 public:
  explicit Front(const MapPlane& wall)
      : plane_(wall.plane_map),
        along_(Eigen::Vector3d::UnitZ().cross(plane_.normal()).normalized()) {
    for (const auto& outline : wall.outlines_map) {
      for (const Eigen::Vector3d& p : outline) {
        const Eigen::Vector2d q(along_.dot(p), p.z());
        low_ = low_.cwiseMin(q);
        high_ = high_.cwiseMax(q);
      }
    }
  }
  bool holds(const Eigen::Vector3d& p_map) const {
    const Eigen::Vector2d q(along_.dot(p_map), p_map.z());
    return (q.array() > low_.array() - kBeside).all() &&
           (q.array() < high_.array() + kBeside).all();
  }
  // m, to the side it was seen from.
  double before(const Eigen::Vector3d& p_map) const {
    return plane_.normal().dot(p_map) - plane_.rho();
  }

 private:
  Plane plane_;
  Eigen::Vector3d along_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high_ = -low_;
};

bool goes_through(const MapPlane& plane, const MapPlane& wall) {
  const double lean = std::abs(plane.plane_map.normal().z());
  if (lean < kLean || lean < 2 * std::abs(wall.plane_map.normal().z())) return false;
  if (wall.observations < kMoreOften * plane.observations) return false;
  if (plane.plane_map.normal().dot(wall.plane_map.normal()) < kAlike) return false;
  const Front front(wall);
  double all = 0, over = 0, before = 0, behind = 0;
  for (const auto& outline : plane.outlines_map) {
    for (const Eigen::Vector3d& p : outline) {
      ++all;
      if (!front.holds(p)) continue;
      const double d = front.before(p);
      if (std::abs(d) > kFarthest) return false;
      ++over;
      before += d > kNear;
      behind += d < -kNear;
    }
  }
  return over > kOver * all && std::min(before, behind) > kAside * over;
}

}  // namespace

std::size_t leave_out_leaning(std::vector<MapPlane>& planes) {
  std::vector<std::size_t> order(planes.size()), stays;
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return planes[a].observations > planes[b].observations;
  });
  std::vector<bool> leans(planes.size(), false);
  for (const std::size_t k : order) {
    if (!upright(planes[k])) continue;
    leans[k] = planes[k].area >= kArea &&
               std::any_of(stays.begin(), stays.end(),
                           [&](std::size_t wall) { return goes_through(planes[k], planes[wall]); });
    if (!leans[k]) stays.push_back(k);
  }
  std::vector<MapPlane> left;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (!leans[k]) left.push_back(std::move(planes[k]));
  }
  const std::size_t out = planes.size() - left.size();
  planes = std::move(left);
  return out;
}

}  // namespace lamina
