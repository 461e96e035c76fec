// The walls of a map in plan: lines with points, looked up by place, and what is known beside them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <lamina/backend/mapper/map_state.hpp>
#include <lamina/backend/merging/free_space.hpp>

namespace lamina {

/// A motion in plan: x_a = R(yaw) x_b + t.
struct PlanPose {
  Eigen::Vector2d t = Eigen::Vector2d::Zero();
  double yaw = 0;

  Eigen::Matrix2d R() const;
  Eigen::Vector2d operator*(const Eigen::Vector2d& x) const { return R() * x + t; }
  PlanPose operator*(const PlanPose& T) const { return {R() * T.t + t, yaw + T.yaw}; }
};

struct PlanWall {
  std::size_t line = 0;                 ///< walls in one line are one fact
  Eigen::Vector2d normal;               ///< towards the side it was seen from
  std::vector<Eigen::Vector2d> points;  ///< one for every 0.1 m of it
  double z_low = 0, z_high = 0;         ///< m, map
  double sigma_m = 0;                   ///< of its distance, 1-sigma
};

/// What stands at a point, asked for a wall there.
enum class Spot { kUnknown, kSame, kOther, kFree };

class PlanWalls {
 public:
  static constexpr double kStep = 0.1;  // m between points

  explicit PlanWalls(const MapState& map, const FreeSpace& free);

  const std::vector<PlanWall>& walls() const { return walls_; }
  std::size_t lines() const { return lines_; }
  const Eigen::Vector2d& low() const { return low_; }  ///< corners of what the points cover
  const Eigen::Vector2d& high() const { return high_; }

  struct Nearest {
    const PlanWall* wall = nullptr;
    double off = 0;  ///< signed distance from it, m
  };
  /// The nearest wall that faces the same way (to `angle` rad) no further than `gate` m off.
  Nearest nearest(const Eigen::Vector2d& x, const Eigen::Vector2d& normal, double gate,
                  double angle) const;
  /// Same: a wall of this map within the gate that faces the same way. Free: rays went through.
  /// Other: something was seen within 0.3 m, but no such wall. `wall`: of another map, its heights.
  Spot look(const Eigen::Vector2d& x, const Eigen::Vector2d& normal, double gate,
            const PlanWall& wall) const;

 private:
  void add(const PlaneLandmark& plane);
  void find_lines();
  static std::int64_t key(std::int64_t i, std::int64_t j) { return i * (1LL << 31) + j; }
  template <class F>
  void near(const Eigen::Vector2d& x, double reach, const F& take) const;

  std::vector<PlanWall> walls_;
  std::size_t lines_ = 0;
  FreeSpace const& free_;
  struct Mark {
    std::uint32_t wall, point;
  };
  std::unordered_map<std::int64_t, std::vector<Mark>> cells_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero(), high_ = Eigen::Vector2d::Zero();
};

}  // namespace lamina
