// Ends of a face in plan, and on which side of the other face they are.
#include <lamina/backend/consistency/crossing_planes.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace lamina {
namespace {

constexpr double kTurned = 10 * M_PI / 180;
constexpr double kOff = 0.05;     // m, of the ends
constexpr double kEven = 3;       // one end's offset over the other's
constexpr double kCovered = 0.6;  // of the smaller face
constexpr double kUpright = 0.5;  // of a normal's z

// A face in plan: a line through `at`, seen from `low` to `high` m along `along`.
struct Line {
  Eigen::Vector2d normal, along, at;
  double low = std::numeric_limits<double>::infinity(), high = -low;
};

std::optional<Line> in_plan(const PlaneLandmark& plane) {
  const Plane map = plane.plane_map();
  const double level = map.normal().head<2>().norm();
  if (std::abs(map.normal().z()) > kUpright || plane.outline.empty()) return std::nullopt;
  Line line;
  line.normal = map.normal().head<2>() / level;
  line.along = {-line.normal.y(), line.normal.x()};
  line.at =
      plane.anchor_map.head<2>() - map.signed_distance(plane.anchor_map) / level * line.normal;
  return line;
}

void reach(const PlaneLandmark& seen, Line& line) {
  const double cell = seen.outline.cell_size();
  for (const auto& [i, j] : seen.outline.cells()) {
    const Eigen::Vector3d p =
        seen.T_map_outline * Eigen::Vector3d((i + 0.5) * cell, (j + 0.5) * cell, 0);
    const double s = line.along.dot(p.head<2>() - line.at);
    line.low = std::min(line.low, s);
    line.high = std::max(line.high, s);
  }
}

}  // namespace

bool cross(const PlaneLandmark& small, std::span<const PlaneLandmark* const> large) {
  auto a = in_plan(small);
  auto b = large.empty() ? std::nullopt : in_plan(*large.front());
  if (!a || !b || !(a->normal.dot(b->normal) > std::cos(kTurned))) return false;
  reach(small, *a);
  for (const PlaneLandmark* part : large) reach(*part, *b);
  const Eigen::Vector2d low = a->at + a->low * a->along, high = a->at + a->high * a->along;
  const double from = b->along.dot(low - b->at), to = b->along.dot(high - b->at);
  if (!(std::min(to, b->high) - std::max(from, b->low) >= kCovered * (to - from))) return false;
  const double off_low = b->normal.dot(low - b->at), off_high = b->normal.dot(high - b->at);
  if (!(off_low * off_high < 0)) return false;
  const double more = std::max(std::abs(off_low), std::abs(off_high));
  return more <= kOff && more <= kEven * std::min(std::abs(off_low), std::abs(off_high));
}

}  // namespace lamina
