// Places of the map that something may hang over, and what looks and the robot's path say of them.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include <lamina/grid/evidence/looks_archive.hpp>
#include <lamina/models/checked_cast.hpp>
#include <lamina/models/model_archive.hpp>
#include <lamina/models/spool.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

constexpr double kLookRadius = 0.06;  // m about a place, as of what moved on
constexpr double kLooksReach = 8;     // m
constexpr int kLooksPast = 3;         // that went past a place

struct HiddenPlace {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  double floor = 0;  // map z
  int past = 0;
};

// Whoever is near a place of `points`: by squares of a metre.
template <class Item>
class Squares {
 public:
  explicit Squares(std::vector<Item>& items) : items_(items) {
    for (std::size_t k = 0; k < items.size(); ++k) squares_[square(items[k].p_map)].push_back(k);
  }
  template <class Visit>
  void for_each_near(const Eigen::Vector3d& p, double reach, const Visit& visit) {
    const auto [i0, j0] = square(p - Eigen::Vector3d(reach, reach, 0));
    const auto [i1, j1] = square(p + Eigen::Vector3d(reach, reach, 0));
    for (auto i = i0; i <= i1; ++i) {
      for (auto s = squares_.lower_bound({i, j0}); s != squares_.end() && s->first <= Square{i, j1};
           ++s) {
        for (const std::size_t k : s->second) visit(items_[k]);
      }
    }
  }

 private:
  using Square = std::pair<std::int64_t, std::int64_t>;
  static Square square(const Eigen::Vector3d& p) {
    return {to_far_cell(p.x()), to_far_cell(p.y())};
  }
  std::vector<Item>& items_;
  std::map<Square, std::vector<std::size_t>> squares_;
};

// Asks every look of the items in its reach: take(item, look, T_map_camera, T_camera_map).
template <class Item, class Take>
void ask(const Spool& looks, const Trajectory& path, std::vector<Item>& items, const Take& take) {
  Squares<Item> squares(items);
  looks.for_each([&](std::string_view bytes) {
    SeenDepth seen;
    ArchiveReader archive(bytes);
    archive(seen);
    const auto T_map_body = path.at(seen.stamp);
    if (!T_map_body) return;
    const SE3 T_map_camera = *T_map_body * seen.T_body_camera,
              T_camera_map = T_map_camera.inverse();
    squares.for_each_near(T_map_camera.translation(), kLooksReach,
                          [&](Item& item) { take(item, seen.look, T_map_camera, T_camera_map); });
  });
}

/// Counts looks that went past; kLooksPast where the robot went: nothing hangs there.
void look_past(const Spool& looks, const Trajectory& path, std::vector<HiddenPlace>& places);

}  // namespace lamina
