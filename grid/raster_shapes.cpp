// Scan conversion.
#include <lamina/grid/raster_shapes.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace lamina::raster {
namespace {

constexpr float kFar = 1e6F;

// Height and uncertainty of a plane over a place. The height along the normal at in-plane offset
// (a, b) from the centre changes by d2 - a d0 - b d1 for the tangent (d0, d1, d2); with (a, b) = A
// d its variance is a quadratic form of the level offset d.
struct Incline {
  Eigen::Vector3d center;
  Eigen::Vector2d gradient;
  double constant = 0, squares_x = 0, squares_y = 0, product = 0;  // of the height's variance
  Eigen::Vector2d linear;
  bool from_above = true;
  Support common;  // what does not depend on the place

  Incline(const Eigen::Vector3d& c, const Eigen::Vector3d& n, const Eigen::Matrix3d& S)
      : center(c), gradient(-n.head<2>() / n.z()), from_above(n.z() >= 0) {
    const Matrix32d basis = Plane::tangent_basis(n);
    const Eigen::Matrix2d A =
        basis.topRows<2>().transpose() + basis.row(2).transpose() * gradient.transpose();
    const double nz2 = n.z() * n.z();
    const Eigen::Matrix2d form = A.transpose() * S.topLeftCorner<2, 2>() * A / nz2;
    constant = S(2, 2) / nz2;
    linear = -A.transpose() * (S.block<2, 1>(0, 2) + S.block<1, 2>(2, 0).transpose()) / nz2;
    squares_x = form(0, 0), squares_y = form(1, 1), product = form(0, 1) + form(1, 0);
    common.slope_x = static_cast<float>(gradient.x());
    common.slope_y = static_cast<float>(gradient.y());
    common.trend = Trend::of(gradient);
    common.tilt_variance = static_cast<float>(std::max(0.0, S(0, 0) + S(1, 1)) / (nz2 * nz2));
  }
  double rise(const Eigen::Vector2d& d) const { return gradient.dot(d); }
  double variance(const Eigen::Vector2d& d) const {
    const double v = constant + linear.dot(d) + squares_x * d.x() * d.x() +
                     squares_y * d.y() * d.y() + product * d.x() * d.y();
    return std::max(0.0, v);
  }
};

// visit(i, j, offset from the disc's centre, rise) for cells whose centres the disc lies over. A
// disc smaller than its cell speaks for it from its own centre.
template <class Visit>
void each_cell(const Surfel& surfel, double reach, const Canvas& canvas, Visit&& visit) {
  const double r = canvas.options.resolution;
  const Eigen::Vector2d middle = surfel.center.head<2>();
  const Eigen::Vector2d gradient = -surfel.normal.head<2>() / surfel.normal.z();
  const CellIndex home = cell_of(middle, r), &first = canvas.tile.first;
  const CellIndex low = cell_of(middle.array() - reach, r),
                  high = cell_of(middle.array() + reach, r);
  for (int j = low.j; j <= high.j; ++j) {
    for (int i = low.i; i <= high.i; ++i) {
      const Eigen::Vector2d d = center_of({i, j}, r) - middle;
      const double rise = gradient.dot(d);
      if (d.squaredNorm() + rise * rise <= reach * reach) {
        visit(i - first.i, j - first.j, d, rise);
      } else if (i == home.i && j == home.j) {
        visit(i - first.i, j - first.j, Eigen::Vector2d::Zero().eval(), 0.0);
      }
    }
  }
}

// A plane holds where its surfels are; one that has none, where others are not.
bool fills(const Support& s, bool has_surfels, int i, int j, const Canvas& canvas) {
  const DiscDistance::Nearest disc = canvas.discs.at(i, j);
  if (disc.distance > canvas.options.plane_ring) return !has_surfels;
  const auto gap = static_cast<float>(canvas.options.level_gap);
  // Half of it: a fill just below it is a level of its own where rounding puts it just above.
  const float apart = has_surfels ? gap / 2 : gap;
  const bool same = std::abs(disc.height - s.height) <= apart;
  // Images that saw what lies below looked through; those that saw what lies above saw nothing
  // under it.
  if (has_surfels && !same)
    return canvas.discs.disc_near(i, j, canvas.options.plane_gap, s.height, apart);
  if (!same || disc.walked <= canvas.options.plane_gap) return true;
  return disc.walked <= canvas.options.wall_gap &&
         canvas.discs.wall_near(i, j, canvas.options.wall_near, s.height);
}

// How far the first disc along a line from a fill, no further than `most` cells, lies from its
// plane (m); NaN: there is none.
float off_plane(const Support& s, int i, int j, int di, int dj, int most, const Canvas& canvas) {
  const auto r = static_cast<float>(canvas.options.resolution);
  for (int k = 1; k <= most; ++k) {
    const float height = canvas.discs.disc(i + k * di, j + k * dj);
    const auto along = r * static_cast<float>(k);
    if (height == height)
      return height - s.height -
             along * (static_cast<float>(di) * s.slope_x + static_cast<float>(dj) * s.slope_y);
  }
  return std::numeric_limits<float>::quiet_NaN();
}

// How far what lies around a fill of a plane that has discs lies from it, within a level: that is
// what the fill belongs to where discs on two opposite sides say so and none beside it is the
// plane's. m.
float off_plane(const Support& s, int i, int j, const Canvas& canvas) {
  const int n = 1 + static_cast<int>(canvas.options.plane_gap / canvas.options.resolution + 1e-9);
  const auto most = static_cast<float>(canvas.options.level_gap / 2);
  const auto of_plane = [&](float off) {
    return off * off <= kSignificant * kSignificant * s.variance;
  };
  float least = 0;
  for (const auto& [di, dj] :
       {std::pair(1, 0), std::pair(0, 1), std::pair(1, 1), std::pair(1, -1)}) {
    const float a = off_plane(s, i, j, di, dj, n, canvas);
    const float b = off_plane(s, i, j, -di, -dj, n, canvas);
    if (of_plane(a) || of_plane(b)) return 0;
    const float off = std::abs(a) < std::abs(b) ? a : b;
    if (!(a * b > 0) || std::abs(off) > most) continue;  // NaN: no disc
    if (least == 0.0F || std::abs(off) < std::abs(least)) least = off;
  }
  return least;
}

// Where the line y = `at` meets the edges of a closed outline, ascending.
void crossings(const std::vector<OutlineBands::Edge>& edges, double at, std::vector<double>& out) {
  out.clear();
  for (const auto& [a, b] : edges) {
    if ((a.y() <= at) == (b.y() <= at)) continue;
    out.push_back(a.x() + (b.x() - a.x()) * (at - a.y()) / (b.y() - a.y()));
  }
  std::sort(out.begin(), out.end());
}

void fill_outline(const std::vector<OutlineBands::Edge>& edges, const Incline& incline,
                  const LocalOffsets::Offset& offset, std::int32_t source, bool has_surfels,
                  Canvas& canvas) {
  const double r = canvas.options.resolution;
  std::vector<double> xs;
  for (int j = 0; j < kSide; ++j) {
    crossings(edges, (canvas.tile.first.j + j + 0.5) * r, xs);
    for (std::size_t k = 0; k + 1 < xs.size(); k += 2) {
      const double x0 = xs[k] / r - 0.5 - canvas.tile.first.i;
      const double x1 = xs[k + 1] / r - 0.5 - canvas.tile.first.i;
      const int i0 = static_cast<int>(std::ceil(std::max(x0, 0.0)));
      const int i1 = static_cast<int>(std::floor(std::min(x1, kSide - 1.0)));
      for (int i = i0; i <= i1; ++i) {
        const Eigen::Vector2d d = canvas.center(i, j) - incline.center.head<2>();
        const auto height = static_cast<float>(incline.center.z() + incline.rise(d));
        if (!incline.from_above) {
          canvas.tile.obstacles.push_back({cell_in(i, j), height, height});
          continue;
        }
        Support s = incline.common;
        s.cell = cell_in(i, j);
        s.source = source;
        s.reach = Support::kPlaneReach;
        s.height = height + static_cast<float>(offset.mean);
        if (canvas.met(s.cell, s.height)) {
          s.reach = Support::kMetReach;
        } else if (!fills(s, has_surfels, i, j, canvas)) {
          continue;
        }
        s.variance = static_cast<float>(offset.predictive(incline.variance(d)));
        if (s.from_plane() && has_surfels) s.height += off_plane(s, i, j, canvas);
        canvas.supports.push_back(s);
      }
    }
  }
}

// Undersides narrower than a cell: their border, in half cells.
void trace_outline(const std::vector<OutlineBands::Edge>& edges, Canvas& canvas) {
  const double step = canvas.options.resolution / 2;
  for (const auto& [a, b] : edges) {
    const int pieces = 1 + static_cast<int>((b - a).norm() / step);
    for (int m = 0; m < pieces; ++m) {
      const Eigen::Vector3d p = a + (b - a) * (m / static_cast<double>(pieces));
      put_obstacle(p.head<2>(), p.z(), p.z(), canvas);
    }
  }
}

}  // namespace

void put_obstacle(const Eigen::Vector2d& xy, double z0, double z1, Canvas& canvas) {
  const CellIndex c = cell_of(xy, canvas.options.resolution);
  const int i = c.i - canvas.tile.first.i, j = c.j - canvas.tile.first.j;
  if (!inside(i, j)) return;
  canvas.tile.obstacles.push_back(
      {cell_in(i, j), static_cast<float>(std::min(z0, z1)), static_cast<float>(std::max(z0, z1))});
}

DiscDistance::DiscDistance(double resolution, double reach)
    : resolution_(resolution),
      margin_(1 + static_cast<int>(std::ceil(reach / resolution))),
      side_(kSide + 2 * margin_) {
  distance_.assign(static_cast<std::size_t>(side_ * side_), kFar);
  height_.assign(distance_.size(), 0.0F);
  variance_.assign(distance_.size(), 0.0F);
  trend_.resize(distance_.size());
  wall_low_.assign(distance_.size(), 0.0F);
  wall_high_.assign(distance_.size(), -1.0F);
}

void DiscDistance::mark(int i, int j, const Support& s, bool of_plane) {
  if (i < -margin_ || j < -margin_ || i >= kSide + margin_ || j >= kSide + margin_) return;
  const std::size_t k = index(i, j);
  if (distance_[k] == 0.0F && s.height <= height_[k]) return;
  height_[k] = s.height;
  variance_[k] = s.variance;
  trend_[k] = of_plane ? s.trend : Trend();
  distance_[k] = 0;
}

void DiscDistance::wall(int i, int j, float low, float high) {
  if (i < -margin_ || j < -margin_ || i >= kSide + margin_ || j >= kSide + margin_) return;
  const std::size_t k = index(i, j);
  const bool any = wall_high_[k] >= wall_low_[k];
  wall_low_[k] = any ? std::min(wall_low_[k], low) : low;
  wall_high_[k] = any ? std::max(wall_high_[k], high) : high;
  walls_ = true;
}

void DiscDistance::spread(float low, float high) {
  low_ = low;
  high_ = high;
  if (walls_) {
    walked_ = distance_;
    walked_height_ = height_;
    leave_out_astride(low, high);
    spread(walked_, walked_height_, low, high, true);
  }
  spread(distance_, height_, low, high, false);
}

// A disc beside a wall may lie astride it: its evidence is from one side, nobody knows which.
// Nothing starts from there.
void DiscDistance::leave_out_astride(float low, float high) {
  const int reach = std::max(1, static_cast<int>(std::lround(kAstride / resolution_)));
  for (int j = 0; j < side_; ++j) {
    for (int i = 0; i < side_; ++i) {
      const auto wall = static_cast<std::size_t>(j * side_ + i);
      if (wall_high_[wall] < wall_low_[wall]) continue;
      for (int v = std::max(0, j - reach); v <= std::min(side_ - 1, j + reach); ++v) {
        for (int u = std::max(0, i - reach); u <= std::min(side_ - 1, i + reach); ++u) {
          const auto k = static_cast<std::size_t>(v * side_ + u);
          if (stands(wall, height_[k], low, high)) walked_[k] = kFar;
        }
      }
    }
  }
}

bool DiscDistance::stands(std::size_t wall, float floor, float low, float high) const {
  return wall_high_[wall] > floor + low && wall_low_[wall] < floor + high &&
         wall_high_[wall] >= wall_low_[wall];
}

void DiscDistance::spread(std::vector<float>& distance, std::vector<float>& height, float low,
                          float high, bool walls) const {
  constexpr float kDiagonal = 1.41421356F;
  const auto relax = [&](int to, int from, float step) {
    const auto t = static_cast<std::size_t>(to), f = static_cast<std::size_t>(from);
    if (distance[f] + step >= distance[t]) return;
    // From a wall nothing goes on.
    if (walls && stands(f, height[f], low, high)) {
      return;
    }
    distance[t] = distance[f] + step;
    height[t] = height[f];
  };
  // The outermost cells are never asked for: they need no care.
  for (int j = 1; j + 1 < side_; ++j) {
    for (int i = 1; i + 1 < side_; ++i) {
      const int k = j * side_ + i;
      if (distance[static_cast<std::size_t>(k)] == 0.0F) continue;
      relax(k, k - 1, 1);
      relax(k, k - side_, 1);
      relax(k, k - side_ - 1, kDiagonal);
      relax(k, k - side_ + 1, kDiagonal);
    }
  }
  for (int j = side_ - 2; j > 0; --j) {
    for (int i = side_ - 2; i > 0; --i) {
      const int k = j * side_ + i;
      if (distance[static_cast<std::size_t>(k)] == 0.0F) continue;
      relax(k, k + 1, 1);
      relax(k, k + side_, 1);
      relax(k, k + side_ + 1, kDiagonal);
      relax(k, k + side_ - 1, kDiagonal);
    }
  }
}

bool DiscDistance::wall_near(int i, int j, double reach, float floor) const {
  if (!walls_) return false;
  const int n = static_cast<int>(reach / resolution_ + 1e-9);
  for (int v = std::max(j - n, -margin_); v <= std::min(j + n, kSide + margin_ - 1); ++v) {
    for (int u = std::max(i - n, -margin_); u <= std::min(i + n, kSide + margin_ - 1); ++u) {
      if (stands(index(u, v), floor, low_, high_)) return true;
    }
  }
  return false;
}

bool DiscDistance::disc_near(int i, int j, double reach, float height, float gap) const {
  const int n = static_cast<int>(reach / resolution_ + 1e-9);
  for (int v = std::max(j - n, -margin_); v <= std::min(j + n, kSide + margin_ - 1); ++v) {
    for (int u = std::max(i - n, -margin_); u <= std::min(i + n, kSide + margin_ - 1); ++u) {
      const std::size_t k = index(u, v);
      if (distance_[k] == 0.0F && std::abs(height_[k] - height) <= gap) return true;
    }
  }
  return false;
}

DiscDistance::Nearest DiscDistance::at(int i, int j) const {
  const std::size_t k = index(i, j);
  const double distance = static_cast<double>(distance_[k]) * resolution_;
  if (walked_.empty()) return {distance, distance, height_[k]};  // no wall, or nothing spread
  const bool reached = walked_[k] < kFar;
  return {distance, static_cast<double>(walked_[k]) * resolution_,
          reached ? walked_height_[k] : height_[k]};
}

void draw_disc(const Surfel& surfel, std::int32_t index, Canvas& canvas) {
  const double r = canvas.options.resolution;
  const double reach = surfel.radius * canvas.options.disc_growth;
  if (std::abs(surfel.normal.z()) < kSteepCosine) {
    const double half = surfel.radius * surfel.normal.head<2>().norm();
    put_obstacle(surfel.center.head<2>(), surfel.center.z() - half, surfel.center.z() + half,
                 canvas);
    return;
  }
  const Eigen::Vector2d middle = surfel.center.head<2>();
  const CellIndex &first = canvas.tile.first, low = cell_of(middle.array() - reach, r),
                  high = cell_of(middle.array() + reach, r);
  const bool outside =
      high.i < first.i || high.j < first.j || low.i >= first.i + kSide || low.j >= first.j + kSide;
  const Incline incline(surfel.center, surfel.normal, surfel.covariance);
  Support s = incline.common;
  s.source = 2 * index;
  const bool of_plane = surfel.parent_plane >= 0;
  if (of_plane) s.trend = canvas.trends.of(surfel.parent_plane, s.trend);
  const auto at = [&](const Eigen::Vector2d& d, double rise) {
    s.height = static_cast<float>(surfel.center.z() + rise);
    s.variance = static_cast<float>(incline.variance(d));
  };
  if (outside) {  // it only tells how far the nearest one is
    each_cell(surfel, reach, canvas, [&](int i, int j, const Eigen::Vector2d& d, double rise) {
      at(d, rise);
      canvas.discs.mark(i, j, s, of_plane);
    });
    return;
  }
  const double per_radius = surfel.radius > 0 ? 1 / surfel.radius : 0.0;
  each_cell(surfel, reach, canvas, [&](int i, int j, const Eigen::Vector2d& d, double rise) {
    at(d, rise);
    canvas.discs.mark(i, j, s, of_plane);
    if (!inside(i, j)) return;
    s.cell = cell_in(i, j);
    s.reach = static_cast<float>(std::sqrt(d.squaredNorm() + rise * rise) * per_radius);
    canvas.supports.push_back(s);
  });
}

void draw_floor(const MapPlane& plane, std::int32_t index, bool has_surfels,
                const OutlineBands& bands, Canvas& canvas) {
  const Eigen::Vector3d& n = plane.plane_map.normal();
  const std::vector<OutlineBands::Piece>& pieces = bands.at(canvas.tile.first.j / kSide);
  if (pieces.empty()) return;
  const Incline incline(plane.centroid_map, n, plane.covariance);
  const LocalOffsets::Offset offset = canvas.offsets.of(plane);
  for (const OutlineBands::Piece& piece : pieces) {
    fill_outline(piece.edges, incline, offset, 2 * index + 1, has_surfels, canvas);
    if (n.z() < 0) trace_outline(piece.edges, canvas);
  }
}

}  // namespace lamina::raster
