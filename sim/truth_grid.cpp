// The true ground: height, navigability, and where a robot gets to.
#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/sim/truth.hpp>

namespace lamina::sim {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kMargin = 6;            // m around the path
constexpr double kSlopeRounding = 1e-4;  // rad: rays meet faces in single precision
constexpr double kSlopeFull = 45 * kPi / 180;

struct Cell {
  bool ground = false;   ///< there is a surface
  bool solid = false;    ///< something stands in the cell within the robot's height
  bool blocked = false;  ///< solid, too steep, or a step to a neighbour above what the robot takes
  double height = 0, slope = 0;
};

void frame_path(const World& world, double resolution, TruthGrid& grid) {
  double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9;
  for (const Knot& knot : world.path.knots()) {
    x0 = std::min(x0, knot.position_map.x()), x1 = std::max(x1, knot.position_map.x());
    y0 = std::min(y0, knot.position_map.y()), y1 = std::max(y1, knot.position_map.y());
  }
  double sx0 = 1e9, sy0 = 1e9, sx1 = -1e9, sy1 = -1e9;
  for (const ScenePlane& plane : world.scene.planes()) {
    for (const Eigen::Vector3d& p : plane.outline_map) {
      sx0 = std::min(sx0, p.x()), sx1 = std::max(sx1, p.x());
      sy0 = std::min(sy0, p.y()), sy1 = std::max(sy1, p.y());
    }
  }
  grid.resolution = resolution;
  grid.x0 = resolution * std::floor(std::max(x0 - kMargin, sx0) / resolution);
  grid.y0 = resolution * std::floor(std::max(y0 - kMargin, sy0) / resolution);
  const double right = std::min(x1 + kMargin, sx1), top = std::min(y1 + kMargin, sy1);
  grid.width = std::max(0, static_cast<int>(std::ceil((right - grid.x0) / resolution - 1e-9)));
  grid.height = std::max(0, static_cast<int>(std::ceil((top - grid.y0) / resolution - 1e-9)));
}

/// A side met from behind in any of four directions: the point is inside a solid, or outdoors. One
/// direction is not enough where a body stands flush against a wall.
bool inside_solid(const Caster& caster, const Eigen::Vector3d& point) {
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0),
                                           Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, -1, 0)}) {
    const auto hit = caster.cast(point, direction);
    const int plane = hit ? caster.plane_of(hit->surface) : -1;
    if (plane >= 0 &&
        caster.scene().planes()[static_cast<std::size_t>(plane)].plane_map.normal().dot(direction) >
            1e-9) {
      return true;
    }
  }
  return false;
}

Cell look(const Caster& caster, double x, double y, double r, double robot_height) {
  Cell cell;
  const auto down = caster.cast({x, y, robot_height}, {0, 0, -1});
  const bool inside = inside_solid(caster, {x, y, robot_height});
  if (down) {
    cell.ground = true;
    cell.solid = inside;
    cell.height = inside ? robot_height : robot_height - down->range;
    cell.slope = inside ? 0 : std::acos(std::clamp(down->normal_map.z(), -1.0, 1.0));
  }
  const double base = down ? cell.height : 0;
  for (double share : {0.06, 0.2, 0.4, 0.7, 0.98}) {
    const double z = std::max(base, 0.0) + share * (robot_height - std::max(base, 0.0));
    cell.solid = cell.solid || caster.cast({x - r / 2, y, z}, {1, 0, 0}, 0, r).has_value() ||
                 caster.cast({x, y - r / 2, z}, {0, 1, 0}, 0, r).has_value();
  }
  return cell;
}

void mark_posts(const Scene& scene, double robot_height, TruthGrid& grid,
                std::vector<Cell>& cells) {
  for (const Cylinder& c : scene.cylinders()) {
    if (std::abs(c.axis_map.z()) < 0.5 || c.base_map.z() > robot_height) {
      continue;
    }
    const double r = c.radius;
    for (double dx : {-r, 0.0, r}) {
      for (double dy : {-r, 0.0, r}) {
        const double i = std::floor((c.base_map.x() + dx - grid.x0) / grid.resolution);
        const double j = std::floor((c.base_map.y() + dy - grid.y0) / grid.resolution);
        if (i >= 0 && j >= 0 && i < grid.width && j < grid.height) {
          cells[grid.index(static_cast<int>(i), static_cast<int>(j))].solid = true;
        }
      }
    }
  }
}

// Visits the cells around (i, j): 4 or 8 of them.
template <class Visit>
void around(const TruthGrid& grid, int i, int j, bool diagonals, const Visit& visit) {
  for (int dj = -1; dj <= 1; ++dj) {
    for (int di = -1; di <= 1; ++di) {
      if ((di == 0 && dj == 0) || (!diagonals && di != 0 && dj != 0)) continue;
      const int u = i + di, v = j + dj;
      if (u >= 0 && v >= 0 && u < grid.width && v < grid.height) visit(grid.index(u, v));
    }
  }
}

/// The product's rule: no wheel on a cell that is steep, or whose step to any of its eight
/// neighbours is more than the robot takes. What stands in a neighbour is no step; nothing below it
/// is one.
void block_steps(const GridRules& rules, const TruthGrid& grid, std::vector<Cell>& cells) {
  for (int j = 0; j < grid.height; ++j) {
    for (int i = 0; i < grid.width; ++i) {
      Cell& cell = cells[grid.index(i, j)];
      cell.blocked = cell.solid || !cell.ground ||
                     cell.slope > rules.max_slope_deg * kPi / 180 + kSlopeRounding;
      around(grid, i, j, true, [&](std::size_t k) {
        const Cell& other = cells[k];
        if (other.solid) return;
        cell.blocked = cell.blocked || !other.ground ||
                       std::abs(other.height - cell.height) > rules.max_step + 1e-9;
      });
    }
  }
}

/// Cells the robot gets to from its start.
void flood(const World& world, const std::vector<Cell>& cells, TruthGrid& grid) {
  const Eigen::Vector3d start = world.path.at(0).translation();
  const int i0 = static_cast<int>(std::floor((start.x() - grid.x0) / grid.resolution));
  const int j0 = static_cast<int>(std::floor((start.y() - grid.y0) / grid.resolution));
  if (i0 < 0 || j0 < 0 || i0 >= grid.width || j0 >= grid.height) return;
  std::vector<std::pair<int, int>> open = {{i0, j0}};
  grid.reachable[grid.index(i0, j0)] = 1;
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    around(grid, i, j, false, [&](std::size_t k) {
      if (grid.reachable[k] > 0 || cells[k].blocked) return;
      grid.reachable[k] = 1;
      open.emplace_back(static_cast<int>(k) % grid.width, static_cast<int>(k) / grid.width);
    });
  }
}

/// Height of the nearest cell the robot gets to: what it would come from.
std::vector<double> reference_heights(const std::vector<Cell>& cells, const TruthGrid& grid) {
  std::vector<double> reference(cells.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<std::size_t> open;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (grid.reachable[k] == 0) continue;
    reference[k] = cells[k].height;
    open.push_back(k);
  }
  for (std::size_t head = 0; head < open.size(); ++head) {
    const std::size_t from = open[head];
    const auto width = static_cast<std::size_t>(grid.width);
    around(grid, static_cast<int>(from % width), static_cast<int>(from / width), false,
           [&](std::size_t k) {
             if (!std::isnan(reference[k])) return;
             reference[k] = reference[from];
             open.push_back(k);
           });
  }
  return reference;
}

/// 0 where the robot cannot be: blocked, nothing below, or a pit. Else the factors of the floor
/// article, the height counted from the floor the robot would come from.
float navigability_of(const Cell& cell, bool reached, double reference, const GridRules& rules) {
  if (cell.blocked || std::isnan(reference)) return 0;
  const double rise = reached ? 0 : cell.height - reference;
  if (rise < -rules.max_step) return 0;
  const double by_height = 1 - std::clamp(rise / rules.robot_height, 0.0, 1.0);
  const double by_slope = cell.slope > kSlopeFull ? 0 : 1 - 0.8 * cell.slope / kSlopeFull;
  return static_cast<float>(by_height * by_slope);
}

}  // namespace

TruthGrid grid_truth(const World& world, const Caster& caster, const GridRules& rules) {
  TruthGrid grid;
  if (world.path.knots().empty() || std::abs(world.path.at(0).translation().z()) > 0.5) {
    return grid;
  }
  double resolution = rules.resolution;
  frame_path(world, resolution, grid);
  const std::size_t size =
      static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height);
  std::vector<Cell> cells(size);
  for (int j = 0; j < grid.height; ++j) {
    for (int i = 0; i < grid.width; ++i) {
      cells[grid.index(i, j)] =
          look(caster, grid.x0 + (i + 0.5) * resolution, grid.y0 + (j + 0.5) * resolution,
               resolution, rules.robot_height);
    }
  }
  mark_posts(world.scene, rules.robot_height, grid, cells);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  grid.surface.assign(size, nan);
  grid.navigability.assign(size, 0);
  grid.reachable.assign(size, 0);
  block_steps(rules, grid, cells);
  flood(world, cells, grid);
  const std::vector<double> reference = reference_heights(cells, grid);
  for (std::size_t k = 0; k < size; ++k) {
    if (cells[k].ground) grid.surface[k] = static_cast<float>(cells[k].height);
    grid.navigability[k] = navigability_of(cells[k], grid.reachable[k] > 0, reference[k], rules);
  }
  return grid;
}

}  // namespace lamina::sim
