// Steep planes in cells.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <lamina/grid/raster_shapes.hpp>

namespace lamina::raster {
namespace {

// Where the line x = `at` meets a closed outline, ascending pairs.
void crossings(const std::vector<Eigen::Vector2d>& outline, double at, std::vector<double>& out) {
  out.clear();
  for (std::size_t k = 0, n = outline.size(); k < n; ++k) {
    const Eigen::Vector2d &a = outline[k], &b = outline[(k + 1) % n];
    if ((a.x() <= at) == (b.x() <= at)) continue;
    out.push_back(a.y() + (b.y() - a.y()) * (at - a.x()) / (b.x() - a.x()));
  }
  std::sort(out.begin(), out.end());
}

void bar(const Eigen::Vector2d& xy, double z0, double z1, Canvas& canvas) {
  const CellIndex c = cell_of(xy, canvas.options.resolution);
  canvas.discs.wall(c.i - canvas.tile.first.i, c.j - canvas.tile.first.j,
                    static_cast<float>(std::min(z0, z1)), static_cast<float>(std::max(z0, z1)));
}

// Outlines of faces are cut in squares of a tenth of a metre: a face of 3 cm would stand 16 cm
// high. Where discs behind it lie above those before it, no further than such a square below its
// upper border, it is a step up, and ends at them. `towards`: who sees it, of length 1; map z, m.
double face_top(const Eigen::Vector2d& foot, const Eigen::Vector2d& towards, double low,
                double high, const Canvas& canvas) {
  constexpr double kBeside = 0.15;  // m
  constexpr double kLowFace = 0.6;  // m: what is higher is no step
  if (high - low > kLowFace) return high;
  const double r = canvas.options.resolution;
  const int n = static_cast<int>(std::ceil(kBeside / r));
  const CellIndex at = cell_of(foot, r);
  const int i0 = at.i - canvas.tile.first.i, j0 = at.j - canvas.tile.first.j;
  double before = 0;
  bool any_before = false;
  std::vector<double> behind;
  for (int j = j0 - n; j <= j0 + n; ++j) {
    for (int i = i0 - n; i <= i0 + n; ++i) {
      const auto height = static_cast<double>(canvas.discs.disc(i, j));
      const Eigen::Vector2d d = canvas.center(i, j) - foot;
      if (!std::isfinite(height) || d.norm() > kBeside) continue;
      const double side = towards.dot(d);
      if (side > r / 2) {
        before = any_before ? std::min(before, height) : height;
        any_before = true;
      } else if (side < -r / 2 && height < high) {
        behind.push_back(height);
      }
    }
  }
  if (behind.empty() || !any_before) return high;  // a pit's side: nobody saw ground before it
  // Discs astride the edge lie between floor and top, and lean: the middle of the upper ones.
  std::sort(behind.begin(), behind.end());
  const auto upper = std::lower_bound(behind.begin(), behind.end(), 0.5 * (before + behind.back()));
  const double top = *(upper + (behind.end() - upper) / 2);
  const bool cut = high - top <= 1.6 * kAstride;  // a square of the outline, and a wall's reach
  return cut && top - before >= canvas.options.least_step ? top : high;
}

// The columns, half a cell apart from u0 on, whose feet may lie in a box: first and last.
std::pair<int, int> columns_in(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                               const Eigen::Vector2d& start, const Eigen::Vector2d& step,
                               int columns) {
  double first = 0, last = columns - 1;
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(step[axis]) < 1e-12) continue;
    const double a = (low[axis] - start[axis]) / step[axis];
    const double b = (high[axis] - start[axis]) / step[axis];
    first = std::max(first, std::min(a, b) - 1);
    last = std::min(last, std::max(a, b) + 1);
  }
  if (!(first <= last)) return {0, -1};
  return {static_cast<int>(first), static_cast<int>(last)};
}

// A steep plane with its outline, along it and up it from its centroid.
struct Wall {
  Wall(const MapPlane& plane, const std::vector<Eigen::Vector3d>& outline)
      : middle(plane.centroid_map),
        n(plane.plane_map.normal()),
        flat(n.head<2>().norm()),
        along(-n.y() / flat, n.x() / flat, 0),
        up(-n.x() * n.z() / flat, -n.y() * n.z() / flat, flat) {
    for (const Eigen::Vector3d& p : outline) {
      const Eigen::Vector3d d = p - middle;
      uv.emplace_back(along.dot(d), up.dot(d));
      u0 = std::min(u0, uv.back().x());
      u1 = std::max(u1, uv.back().x());
      lean = std::max(lean, std::abs(uv.back().y() * n.z()));
    }
  }
  Eigen::Vector3d middle, n;
  double flat;  // length of the normal's level part
  Eigen::Vector3d along, up;
  std::vector<Eigen::Vector2d> uv;
  double u0 = 1e300, u1 = -1e300;
  double lean = 0;  // m: of its outline, out of the upright through its centroid
};

// A column of a wall, from v0 above `foot` on; where it leans, pieces that stay in a cell.
void draw_column(const Wall& wall, const Eigen::Vector3d& foot, double v0, double span,
                 Canvas& canvas) {
  const Eigen::Vector3d &n = wall.n, &up = wall.up;
  const double r = canvas.options.resolution;
  // Half a cell either way: whose centre is that near to a wall is touched by it, and a wall on the
  // border of two cells stands in both.
  const Eigen::Vector2d aside = 0.5 * r / wall.flat * n.head<2>();
  const double top = face_top((foot + (v0 + 0.5 * span) * up).head<2>(), n.head<2>() / wall.flat,
                              (foot + v0 * up).z(), (foot + (v0 + span) * up).z(), canvas);
  const bool stepped = top < (foot + (v0 + span) * up).z();
  const int pieces = 1 + static_cast<int>(span * std::abs(n.z()) / (r / 2));
  for (int q = 0; q < pieces; ++q) {
    const Eigen::Vector3d a = foot + (v0 + span * q / pieces) * up;
    Eigen::Vector3d b = foot + (v0 + span * (q + 1) / pieces) * up;
    if (q > 0 && a.z() > top) break;
    b.z() = std::max(a.z(), std::min(b.z(), top));
    const Eigen::Vector2d middle = 0.5 * (a + b).head<2>();
    // A step's face is where its top begins: what lies before it is floor.
    for (double share = -1; share <= (stepped ? -1 : 1); ++share) {
      put_obstacle(middle + share * aside, a.z(), b.z(), canvas);
      bar(middle + share * aside, a.z(), b.z(), canvas);
    }
  }
}

// Columns half a cell apart along the wall.
void draw_wall(const MapPlane& plane, const std::vector<Eigen::Vector3d>& outline, Canvas& canvas) {
  const Wall wall(plane, outline);
  const double r = canvas.options.resolution, u0 = wall.u0, u1 = wall.u1;
  const double margin = r + wall.lean + wall_reach(canvas.options);
  const Eigen::Vector2d low = canvas.center(0, 0).array() - margin;
  const Eigen::Vector2d high = canvas.center(kSide - 1, kSide - 1).array() + margin;
  const int columns = std::max(1, static_cast<int>(std::ceil((u1 - u0) / (r / 2))));
  const double width = (u1 - u0) / columns;
  const auto [first, last] =
      columns_in(low, high, (wall.middle + (u0 + 0.5 * width) * wall.along).head<2>(),
                 width * wall.along.head<2>(), columns);
  std::vector<double> vs;
  for (int k = first; k <= last; ++k) {
    const double u = u0 + (k + 0.5) * (u1 - u0) / columns;
    const Eigen::Vector3d foot = wall.middle + u * wall.along;
    if ((foot.head<2>().array() < low.array()).any() ||
        (foot.head<2>().array() > high.array()).any()) {
      continue;
    }
    crossings(wall.uv, u, vs);
    for (std::size_t m = 0; m + 1 < vs.size(); m += 2) {
      const double v0 = vs[m] - kAstride / 2;
      draw_column(wall, foot, v0, vs[m + 1] + kAstride / 2 - v0, canvas);
    }
  }
}

}  // namespace

double wall_reach(const RasterOptions& options) {
  return std::max(options.wall_gap + kAstride, options.wall_near) + options.resolution;
}

void draw_walls(const MapPlane& plane, Canvas& canvas) {
  for (const std::vector<Eigen::Vector3d>& outline : plane.outlines_map) {
    if (!outline.empty()) draw_wall(plane, outline, canvas);
  }
}

}  // namespace lamina::raster
