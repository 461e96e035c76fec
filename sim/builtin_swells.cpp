// Built-in worlds whose floor is no plane: uneven.
#include <algorithm>
#include <cmath>
#include <vector>

#include <lamina/sim/builtin.hpp>
#include <lamina/sim/random.hpp>

namespace lamina::sim {
namespace {

/// Ground that swells: a sum of waves of different lengths and directions.
class Swells {
 public:
  /// `height`: m, of the highest places over the mean, about; `least`, `most`: wave lengths, m.
  Swells(double height, double least, double most, std::uint64_t seed) {
    const int count = 6;
    const double sigmas = 2.5;  // of the sum, from its mean to its highest places
    Random random(seed, 0);
    const double amplitude = height / sigmas * std::sqrt(2.0 / count);
    for (int i = 0; i < count; ++i) {
      const double direction = random.uniform(0, M_PI), phase = random.uniform(0, 2 * M_PI);
      const double wave = 2 * M_PI / (least + (most - least) * (i + 0.5) / count);
      waves_.push_back({wave * std::cos(direction), wave * std::sin(direction), phase, amplitude});
    }
  }
  double operator()(double x, double y) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += w.amplitude * std::sin(w.x * x + w.y * y + w.phase);
    return sum;
  }

 private:
  struct Wave {
    double x, y, phase, amplitude;
  };
  std::vector<Wave> waves_;
};

/// Half of what is between the axles, and between the wheels of one, m.
struct Axles {
  double half_base = 0.2, half_track = 0.15;
};

/// A body on two axles of two wheels each: the plane nearest to where they stand.
Knot on_axles(const Knot& flat, const Swells& ground) {
  const auto [base, track] = Axles();
  const double c = std::cos(flat.yaw), s = std::sin(flat.yaw);
  const auto wheel = [&](double x, double y) {
    return ground(flat.position_map.x() + c * x - s * y, flat.position_map.y() + s * x + c * y);
  };
  const double front_left = wheel(base, track), front_right = wheel(base, -track);
  const double rear_left = wheel(-base, track), rear_right = wheel(-base, -track);
  Knot knot = flat;
  knot.position_map.z() = (front_left + front_right + rear_left + rear_right) / 4;
  knot.pitch = std::atan2(rear_left + rear_right - front_left - front_right, 4 * base);
  knot.roll = std::atan2(front_left + rear_left - front_right - rear_right, 4 * track);
  return knot;
}

/// The same way at the same times, as the ground carries the body.
Path on_ground(const Path& flat, const Swells& ground) {
  const double step = 0.04;  // s
  std::vector<Knot> knots;
  for (double time = 0; time < flat.duration() + step; time += step) {
    const double at = std::min(time, flat.duration());
    const SE3 T = flat.at(at);
    Knot knot{at, T.translation(), T.so3().yaw(), 0, 0};
    if (!knots.empty())
      knot.yaw = knots.back().yaw + std::remainder(knot.yaw - knots.back().yaw, 2 * M_PI);
    knots.push_back(on_axles(knot, ground));
  }
  return Path(std::move(knots));
}

RigDefaults with_camera() {
  RigDefaults d;
  d.odometry_rotation = 0.01;
  d.odometry_drift_deg = 0.2;
  d.odometry_scale = 1.01;
  return d;
}

}  // namespace

void build_uneven(Settings& s, World& world) {
  world.rig = make_rig(s, with_camera());
  const double length = s.number("uneven.length_m", 12), width = s.number("uneven.width_m", 8);
  const Swells ground(s.number("uneven.swell_cm", 2) / 100, s.number("uneven.least_m", 1),
                      s.number("uneven.most_m", 3),
                      static_cast<std::uint64_t>(s.integer("uneven.floor", 1)));
  const double top = 3, below = -0.2, cell = 0.05;  // m, of the walls; of a facet
  const double x = length / 2, y = width / 2;
  Scene& scene = world.scene;
  scene.add_terrain("floor", PlaneLabel::kFloor, {-x, -y, x, y}, cell, ground);
  const std::vector<Eigen::Vector2d> corners = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    scene.add_wall("wall." + std::to_string(i), corners[i], corners[(i + 1) % corners.size()],
                   below, top);
  }
  scene.add_box("crate", SE3(SO3::rot_z(0.4), {x - 0.7, y - 0.6, below}), {0.9, 0.6, 1.0});
  scene.add_box("cupboard", SE3(SO3(), {-x + 0.9, -y + 0.3, below}), {1.2, 0.6, 1.8});
  const double a = x - 1.8, b = y - 1.8;
  const Path flat = Path::drive({{-a, -b, 0},
                                 {a, -b, 0},
                                 {a, b, 0},
                                 {-a, b, 0},
                                 {-a, -b, 0},
                                 {0, -b, 0},
                                 {0, b, 0},
                                 {-a, b, 0},
                                 {-a, -b, 0}},
                                s.number("path.speed", 0.5), s.number("path.turn_rate", 0.8));
  world.path = on_ground(flat, ground);
}

}  // namespace lamina::sim
