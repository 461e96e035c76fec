// Legs, triangles of them, and what looks say of the space over these.
#include <lamina/grid/evidence/legs.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>
#include <utility>

#include <lamina/grid/evidence/hidden_places.hpp>
#include <lamina/models/checked_cast.hpp>
#include <lamina/models/median.hpp>

namespace lamina {
namespace {

constexpr double kWidest = 0.3;     // m of a leg as drawn: its points lie centimetres about it
constexpr double kFoot = 0.2;       // m above the floor, at the most
constexpr double kTallest = 0.2;    // m above the floor that a leg was seen to reach, at the least
constexpr double kUnseen = 0.1;     // m above its seen top where a leg that goes on would be met
constexpr double kApart = 1.1;      // m from leg to leg, across a table, too
constexpr double kBeside = 0.05;    // m beside a triangle: tops reach over their legs
constexpr double kHangs = 0.3;      // m above the floor, at the least
constexpr double kThickest = 0.25;  // m of what hangs, by outlines in squares of 0.1 m
constexpr int kMostCells = 100;     // kLength is, of the finest grid
constexpr double kLength = 0.2;     // m of what hangs, at the least
constexpr double kLevel = 0.05;     // m from height to height

struct Stand {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();  // z: its seen top
  double floor = 0;                                 // map z
  double top() const { return p_map.z() - floor; }
};
using Solid = std::map<CellIndex, SolidCell>;
using Triangle = std::array<Eigen::Vector2d, 3>;

double apart(const Stand& a, const Stand& b) { return (a.p_map - b.p_map).head<2>().norm(); }

// Things of solid cells that touch, corners too.
std::vector<std::vector<const SolidCell*>> things_of(const Solid& solid) {
  std::vector<std::vector<const SolidCell*>> things;
  std::set<CellIndex> taken;
  for (const auto& [cell, first] : solid) {
    if (!taken.insert(cell).second) continue;
    auto& thing = things.emplace_back();
    thing.push_back(&first);
    for (std::size_t k = 0; k < thing.size(); ++k) {
      const CellIndex at = thing[k]->cell;
      for (int dj = -1; dj <= 1; ++dj) {
        for (int di = -1; di <= 1; ++di) {
          const auto next = solid.find({at.i + di, at.j + dj});
          if (next != solid.end() && taken.insert(next->first).second)
            thing.push_back(&next->second);
        }
      }
    }
  }
  return things;
}

// Thin things that stand on the floor and end, as far as was seen, below the robot's height.
std::vector<Stand> posts_of(const Solid& solid, double resolution, double robot_height) {
  std::vector<Stand> posts;
  for (const auto& thing : things_of(solid)) {
    Eigen::Array2d low = center_of(thing.front()->cell, resolution), high = low, sum(0, 0);
    std::vector<double> floors;
    double foot = thing.front()->low, top = thing.front()->high;
    for (const SolidCell* s : thing) {
      const Eigen::Array2d p = center_of(s->cell, resolution);
      low = low.min(p);
      high = high.max(p);
      sum += p;
      floors.push_back(s->floor);
      foot = std::min(foot, s->low);
      top = std::max(top, s->high);
    }
    if ((high - low).maxCoeff() + resolution > kWidest + resolution / 2) continue;
    const double floor = median(floors);
    if (foot > floor + kFoot || top < floor + kTallest || top > floor + robot_height - kUnseen)
      continue;
    sum /= static_cast<double>(thing.size());
    posts.push_back({{sum.x(), sum.y(), top}, floor});
  }
  return posts;
}

// Less those that looks went past above: they end there.
std::vector<Stand> legs_of(std::vector<Stand> posts, const Spool& looks,
                           const Trajectory& trajectory, double robot_height) {
  std::vector<HiddenPlace> places;
  std::vector<std::size_t> post_of;
  for (std::size_t k = 0; k < posts.size(); ++k) {
    const Stand& post = posts[k];
    for (double z = post.p_map.z() + kUnseen; z <= post.floor + robot_height; z += kLevel) {
      places.push_back({{post.p_map.x(), post.p_map.y(), z}, post.floor, 0});
      post_of.push_back(k);
    }
  }
  look_past(looks, trajectory, places);
  std::vector<bool> ends(posts.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (places[k].past >= kLooksPast) ends[post_of[k]] = true;
  }
  std::vector<Stand> legs;
  for (std::size_t k = 0; k < posts.size(); ++k) {
    if (!ends[k]) legs.push_back(posts[k]);
  }
  return legs;
}

std::vector<Stand> hanging(const Solid& solid, double resolution) {
  const auto hangs = [](const SolidCell& s) {
    return s.low > s.floor + kHangs && s.high <= s.low + kThickest;
  };
  const int n = to_whole(std::ceil(kLength / resolution), 1, kMostCells);
  std::vector<Stand> all;
  for (const auto& [cell, s] : solid) {
    if (!hangs(s)) continue;
    int beside = 0;
    for (int dj = -n; dj <= n; ++dj) {
      for (int di = -n; di <= n; ++di) {
        const auto other = solid.find({cell.i + di, cell.j + dj});
        beside += other != solid.end() && hangs(other->second);
      }
    }
    if (beside * resolution < kLength) continue;
    const Eigen::Vector2d c = center_of(cell, resolution);
    all.push_back({{c.x(), c.y(), s.high}, s.floor});
  }
  return all;
}

double distance(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d d = b - a;
  const double s = std::clamp((p - a).dot(d) / std::max(d.squaredNorm(), 1e-12), 0.0, 1.0);
  return (p - a - s * d).norm();
}

// Within it, or kBeside of its border.
bool holds(const Triangle& t, const Eigen::Vector2d& p) {
  double least = 1, most = -1, near = 1e9;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector2d &a = t[k], &b = t[(k + 1) % 3];
    const double side = (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
    least = k == 0 ? side : std::min(least, side);
    most = k == 0 ? side : std::max(most, side);
    near = std::min(near, distance(p, a, b));
  }
  return least >= 0 || most <= 0 || near <= kBeside;
}

struct Between {
  double from = 0, floor = 0;  // map z: the lowest seen top, and the floor
};

class Cells {
 public:
  explicit Cells(double resolution) : resolution_(resolution) {}
  void add(const Stand& a, const Stand& b, const Stand& c) {
    const Triangle t{a.p_map.head<2>(), b.p_map.head<2>(), c.p_map.head<2>()};
    const Eigen::Array2d low = t[0].array().min(t[1].array()).min(t[2].array()) - kBeside,
                         high = t[0].array().max(t[1].array()).max(t[2].array()) + kBeside;
    const Between between{std::min({a.p_map.z(), b.p_map.z(), c.p_map.z()}), a.floor};
    const CellIndex first = cell_of(low.matrix(), resolution_),
                    last = cell_of(high.matrix(), resolution_);
    for (auto j = first.j; j <= last.j; ++j) {
      for (auto i = first.i; i <= last.i; ++i) {
        if (!holds(t, center_of({i, j}, resolution_))) continue;
        const auto [at, fresh] = cells.try_emplace({i, j}, between);
        if (!fresh && between.from < at->second.from) at->second = between;
      }
    }
  }
  std::map<CellIndex, Between> cells;

 private:
  double resolution_;
};

}  // namespace

std::vector<CellIndex> between_legs(const std::vector<SolidCell>& solid_cells, const Spool& looks,
                                    const Trajectory& trajectory, double resolution,
                                    double robot_height) {
  if (looks.size() == 0) return {};
  Solid solid;
  for (const SolidCell& s : solid_cells) solid.emplace(s.cell, s);
  std::vector<Stand> legs =
      legs_of(posts_of(solid, resolution, robot_height), looks, trajectory, robot_height);
  if (legs.size() < 2) return {};
  std::vector<Stand> tops = hanging(solid, resolution);
  Squares<Stand> legs_near(legs), tops_near(tops);
  Cells between(resolution);
  for (const Stand& a : legs) {
    legs_near.for_each_near(a.p_map, kApart, [&](const Stand& b) {
      if (&b <= &a || apart(a, b) > kApart || std::abs(b.floor - a.floor) > kFoot) return;
      const auto close_to_both = [&](const Stand& c) {
        return apart(a, c) <= kApart && apart(b, c) <= kApart &&
               std::abs(c.floor - a.floor) <= kFoot;
      };
      legs_near.for_each_near(a.p_map, kApart, [&](const Stand& c) {
        if (&c > &b && close_to_both(c)) between.add(a, b, c);
      });
      tops_near.for_each_near(a.p_map, kApart, [&](const Stand& c) {
        if (c.top() >= std::min(a.top(), b.top()) - kUnseen && close_to_both(c))
          between.add(a, b, c);
      });
    });
  }
  std::vector<HiddenPlace> places;
  std::vector<CellIndex> cell_of_place;
  for (const auto& [cell, b] : between.cells) {
    const Eigen::Vector2d c = center_of(cell, resolution);
    for (double z = b.from; z <= b.floor + robot_height; z += kLevel) {
      places.push_back({{c.x(), c.y(), z}, b.floor, 0});
      cell_of_place.push_back(cell);
    }
  }
  look_past(looks, trajectory, places);
  std::set<CellIndex> hidden;
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (places[k].past < kLooksPast) hidden.insert(cell_of_place[k]);
  }
  return {hidden.begin(), hidden.end()};
}

}  // namespace lamina
