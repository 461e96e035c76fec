// Crossings of segments in plan, gap by gap.
#include <lamina/backend/association/line_of_sight.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

#include <lamina/backend/association/plane_index.hpp>
#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kBin = 0.1;  // m, along a gap
constexpr std::size_t kMostBins = 10000;
constexpr double kSpacing = 0.3;    // m, of points that were seen
constexpr int kLines = 2;           // through a bin that is open
constexpr double kBefore = 0.3;     // m: what was seen is not looked through
constexpr double kFarthest = 30;    // m from the keyframe: sight lines of interest
constexpr double kLongestStep = 2;  // m between keyframes: further apart, the way is not known

// Where along a -> b the line from -> to crosses it, 0 to 1.
std::optional<double> crossing(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                               const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const auto cross = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
    return u.x() * v.y() - u.y() * v.x();
  };
  const Eigen::Vector2d gap = b - a, line = to - from;
  const double d = cross(gap, line);
  if (std::abs(d) < 1e-9) return std::nullopt;
  const double along_gap = cross(from - a, line) / d, along_line = cross(from - a, gap) / d;
  if (along_gap < 0 || along_gap >= 1 || along_line < 0 || along_line > 1) return std::nullopt;
  return along_gap;
}

class Looks {
 public:
  explicit Looks(std::span<SightGap> gaps) : gaps_(gaps) {}

  // Gaps that a keyframe here may look through.
  void stand(const Eigen::Vector2d& from) {
    from_ = from;
    near_.clear();
    for (SightGap& gap : gaps_) {
      if ((0.5 * (gap.a + gap.b) - from).norm() < kFarthest) near_.push_back(&gap);
    }
  }
  void through(const Eigen::Vector2d& to, int lines = 1) {
    for (SightGap* gap : near_) {
      const auto at = crossing(gap->a, gap->b, from_, to);
      if (!at) continue;
      const auto n = static_cast<double>(gap->lines.size());
      if (!gap->lines.empty()) gap->lines[to_index(*at * n, gap->lines.size() - 1)] += lines;
    }
  }
  void at(const Eigen::Vector2d& seen) {
    const double length = (seen - from_).norm();
    if (length > kBefore) through(from_ + (1 - kBefore / length) * (seen - from_));
  }

 private:
  std::span<SightGap> gaps_;
  std::vector<SightGap*> near_;
  Eigen::Vector2d from_ = Eigen::Vector2d::Zero();
};

}  // namespace

SightGap::SightGap(const Eigen::Vector2d& from, const Eigen::Vector2d& to)
    : a(from), b(to), lines(to_index(std::ceil((to - from).norm() / kBin), kMostBins)) {}

double SightGap::open() const {
  const auto n = std::count_if(lines.begin(), lines.end(), [](int k) { return k >= kLines; });
  return lines.empty() ? 0 : static_cast<double>(n) / static_cast<double>(lines.size());
}

void look_through(const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
                  std::span<SightGap> gaps) {
  std::map<KeyframeId, std::vector<Eigen::Vector2d>> seen;
  for (const auto& [id, pieces] : outlines) {
    const PlaneLandmark* plane = graph.find(id);
    if (!plane || !plane->active || std::abs(plane->plane_anchor.normal().z()) > kUprightNormal)
      continue;
    for (const OutlinePiece& piece : pieces) {
      const Keyframe* keyframe = graph.find(piece.keyframe);
      if (!keyframe) continue;
      for (const auto& p : sample_outline(piece.points_body, kSpacing)) {
        seen[piece.keyframe].push_back((keyframe->T_map_body * p).head<2>());
      }
    }
  }
  Looks looks(gaps);
  const Keyframe* last = nullptr;
  for (const Keyframe& keyframe : graph.keyframes) {
    const Eigen::Vector2d here = keyframe.T_map_body.translation().head<2>();
    looks.stand(here);
    const auto points = seen.find(keyframe.id);
    if (points != seen.end()) {
      for (const auto& p : points->second) looks.at(p);
    }
    if (last) {
      const Eigen::Vector2d there = last->T_map_body.translation().head<2>();
      if ((here - there).norm() < kLongestStep) looks.through(there, kLines);
    }
    last = &keyframe;
  }
}

}  // namespace lamina
