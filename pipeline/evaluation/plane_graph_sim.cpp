// Makes rooms, poses and observations, and writes them as text.
#include <lamina/pipeline/evaluation/plane_graph_sim.hpp>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <ostream>
#include <vector>

#include <lamina/models/error.hpp>
#include <lamina/models/plane.hpp>
#include <lamina/sim/random.hpp>

namespace lamina::sim {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kPitch = 6.0, kStorey = 3.0, kHalf = 2.9, kHeight = 2.8;  // m
constexpr double kPatch = 0.8;  // m: an observation's points lie within this of their centre
enum Stream : std::uint64_t { kRooms, kOdometry, kObservations };

struct Room {
  Eigen::Vector3d floor_center;
  std::vector<std::int64_t> planes;
};

struct PatchPlane {
  Plane plane;
  Eigen::Vector3d center;   ///< middle of what can be seen of it
  double half;              ///< half extent along both tangents, m
  bool everywhere = false;  ///< in every room of its storey
};

struct Building {
  std::vector<Room> rooms;  ///< in the order they are visited
  std::vector<PatchPlane> planes;
};

std::int64_t add_plane(Building& building, const Eigen::Vector3d& normal,
                       const Eigen::Vector3d& center, double half) {
  building.planes.push_back({Plane(normal, normal.normalized().dot(center)), center, half});
  return static_cast<std::int64_t>(building.planes.size()) - 1;
}

Room make_room(Building& building, const Eigen::Vector3d& center, std::int64_t shared_floor,
               Random& random) {
  Room room;
  room.floor_center = center;
  const Eigen::Vector3d middle = center + Eigen::Vector3d(0, 0, kHeight / 2);
  const Eigen::Vector3d side[4] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  for (const Eigen::Vector3d& inward : side) {
    // Walls of neighbouring rooms differ by centimetres, so that a wrong match costs something.
    const double wall = kHalf + random.uniform(-0.02, 0.02);
    room.planes.push_back(add_plane(building, inward, middle - wall * inward, 1.2));
  }
  room.planes.push_back(
      shared_floor >= 0 ? shared_floor : add_plane(building, Eigen::Vector3d::UnitZ(), center, 2));
  room.planes.push_back(
      add_plane(building, -Eigen::Vector3d::UnitZ(), center + Eigen::Vector3d(0, 0, kHeight), 2));
  // A tilted panel in the middle, below the sensor's height and facing up.
  const double tilt = random.uniform(0.2, 0.7), heading = random.uniform(-kPi, kPi);
  const Eigen::Vector3d normal(std::sin(tilt) * std::cos(heading),
                               std::sin(tilt) * std::sin(heading), std::cos(tilt));
  room.planes.push_back(add_plane(
      building, normal,
      center + Eigen::Vector3d(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0.3), 0.3));
  return room;
}

Building make_building(const PlaneGraphOptions& o) {
  Building building;
  Random random(o.seed, kRooms);
  for (int storey = 0; storey < o.storeys; ++storey) {
    std::int64_t floor = -1;
    if (o.shared_floor) {
      floor = add_plane(building, Eigen::Vector3d::UnitZ(), {0, 0, storey * kStorey}, 2);
      building.planes.back().everywhere = true;
    }
    for (int row = 0; row < o.rooms_y; ++row) {
      for (int k = 0; k < o.rooms_x; ++k) {
        const int column = row % 2 == 0 ? k : o.rooms_x - 1 - k;  // to and fro
        const Eigen::Vector3d center((column + 0.5) * kPitch, (row + 0.5) * kPitch,
                                     storey * kStorey);
        building.rooms.push_back(make_room(building, center, floor, random));
      }
    }
  }
  return building;
}

SE3 pose_in_room(const Room& room, int lap, int laps, int step, int steps) {
  const double angle = 2 * kPi * (step + (steps > 1 ? static_cast<double>(lap) / laps : 0)) / steps;
  const Eigen::Vector3d position =
      room.floor_center + Eigen::Vector3d(1.5 * std::cos(angle), 1.5 * std::sin(angle),
                                          1.2 + 0.25 * std::sin(2 * angle));
  const double roll = 0.1 * std::sin(3 * angle), pitch = 0.1 * std::cos(2 * angle);
  return SE3(SO3::rot_z(angle + kPi / 2) * SO3::rot_y(pitch) * SO3::rot_x(roll), position);
}

void print(std::ostream& out, const char* kind, std::int64_t i, std::int64_t j,
           const double* values, int count) {
  char text[400];
  int n = std::snprintf(text, sizeof text, "%s %lld", kind, static_cast<long long>(i));
  if (j >= 0) {
    n += std::snprintf(text + n, sizeof text - static_cast<std::size_t>(n), " %lld",
                       static_cast<long long>(j));
  }
  for (int k = 0; k < count; ++k) {
    n += std::snprintf(text + n, sizeof text - static_cast<std::size_t>(n), " %.12g", values[k]);
  }
  text[n++] = '\n';
  out.write(text, n);
}

void print_pose(std::ostream& out, const char* kind, std::int64_t i, std::int64_t j, const SE3& T) {
  const Eigen::Vector4d& q = T.so3().quaternion().coeffs();
  const Eigen::Vector3d& t = T.translation();
  const double values[7] = {q[0], q[1], q[2], q[3], t[0], t[1], t[2]};
  print(out, kind, i, j, values, 7);
}

/// Odometry measured between consecutive poses: the true motion and a random error on its right.
std::vector<SE3> measure_odometry(const PlaneGraphOptions& o, const std::vector<SE3>& truth) {
  Random random(o.seed, kOdometry);
  std::vector<SE3> steps;
  for (std::size_t i = 0; i + 1 < truth.size(); ++i) {
    Vector6d error;
    for (int k = 0; k < 6; ++k) {
      error[k] = (k < 3 ? o.sigma_translation : o.sigma_rotation) * random.normal();
    }
    steps.push_back(truth[i].inverse() * truth[i + 1] * SE3::exp(error));
  }
  return steps;
}

/// One observation: points of a patch of the plane near the sensor, in its frame.
void print_observation(std::ostream& out, const PlaneGraphOptions& o, std::int64_t i,
                       std::int64_t j, const SE3& T_map_sensor, const PatchPlane& p,
                       Random& random) {
  const Matrix32d basis = p.plane.tangent_basis();
  const Eigen::Vector3d middle = p.center + basis * Eigen::Vector2d(random.uniform(-1, 1) * p.half,
                                                                    random.uniform(-1, 1) * p.half);
  const SE3 T_sensor_map = T_map_sensor.inverse();
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (int k = 0; k < o.points; ++k) {
    const Eigen::Vector2d at(random.uniform(-kPatch, kPatch), random.uniform(-kPatch, kPatch));
    Eigen::Vector3d x = T_sensor_map * (middle + basis * at);
    for (int axis = 0; axis < 3; ++axis) {
      x[axis] += o.sigma_point * random.normal();
    }
    const Eigen::Vector4d h = x.homogeneous();
    sum += h * h.transpose();
  }
  double values[10];
  int n = 0;
  for (int r = 0; r < 4; ++r) {
    for (int c = r; c < 4; ++c) {
      values[n++] = sum(r, c);
    }
  }
  print(out, "OBS", i, j, values, 10);
}

/// Where the sensor is, and in which room.
struct Tour {
  std::vector<SE3> poses;
  std::vector<std::size_t> room_of;
};

Tour make_tour(const PlaneGraphOptions& o, const Building& building) {
  Tour tour;
  for (int lap = 0; lap < o.laps; ++lap) {
    for (std::size_t r = 0; r < building.rooms.size(); ++r) {
      for (int step = 0; step < o.poses_per_room; ++step) {
        tour.poses.push_back(pose_in_room(building.rooms[r], lap, o.laps, step, o.poses_per_room));
        tour.room_of.push_back(r);
      }
    }
  }
  return tour;
}

std::int64_t print_observations(std::ostream& out, const PlaneGraphOptions& o,
                                const Building& building, const Tour& tour) {
  Random random(o.seed, kObservations);
  std::int64_t count = 0;
  for (std::size_t i = 0; i < tour.poses.size(); ++i) {
    const Room& room = building.rooms[tour.room_of[i]];
    const auto see = [&](std::int64_t j, double chance) {
      const bool chosen = random.uniform() < chance;
      PatchPlane plane = building.planes[static_cast<std::size_t>(j)];
      if (!chosen || plane.plane.signed_distance(tour.poses[i].translation()) < 0.05) {
        return;
      }
      if (plane.everywhere) {
        plane.center = room.floor_center;
      }
      print_observation(out, o, static_cast<std::int64_t>(i), j, tour.poses[i], plane, random);
      ++count;
    };
    for (std::int64_t j : room.planes) {
      see(j, o.visibility);
    }
    if (tour.room_of[i] + 1 < building.rooms.size()) {
      const Room& next = building.rooms[tour.room_of[i] + 1];
      for (std::size_t k = 0; k < 4; ++k) {
        see(next.planes[k], o.through_door);
      }
    }
  }
  return count;
}

}  // namespace

void PlaneGraphOptions::check() const {
  const auto need = [](bool good, const char* what) {
    if (!good) {
      throw input_error("plane graph", what, "a value out of range", "see PlaneGraphOptions");
    }
  };
  need(rooms_x > 0 && rooms_y > 0 && storeys > 0, "rooms");
  need(poses_per_room > 0 && laps > 0, "poses_per_room, laps");
  need(points >= 3, "points");
  need(sigma_translation >= 0 && sigma_rotation >= 0 && sigma_point >= 0, "sigmas");
  need(visibility >= 0 && visibility <= 1 && through_door >= 0 && through_door <= 1, "visibility");
}

std::int64_t PlaneGraphOptions::poses() const {
  return std::int64_t{rooms_x} * rooms_y * storeys * poses_per_room * laps;
}

std::int64_t PlaneGraphOptions::planes() const {
  const std::int64_t rooms = std::int64_t{rooms_x} * rooms_y * storeys;
  return shared_floor ? 6 * rooms + storeys : 7 * rooms;
}

PlaneGraphOptions PlaneGraphOptions::of_size(std::int64_t poses) {
  PlaneGraphOptions o;
  const double rooms = std::max(1.0, static_cast<double>(poses) / (o.poses_per_room * o.laps));
  o.storeys = rooms >= 4 ? 2 : 1;
  o.rooms_x = std::max(1, static_cast<int>(std::lround(std::sqrt(rooms / o.storeys))));
  o.rooms_y = std::max(1, static_cast<int>(std::lround(rooms / o.storeys / o.rooms_x)));
  return o;
}

PlaneGraphCounts write_plane_graph(const PlaneGraphOptions& o, std::ostream& out) {
  o.check();
  const Building building = make_building(o);
  const Tour tour = make_tour(o, building);
  const std::vector<SE3> steps = measure_odometry(o, tour.poses);
  char head[120];
  std::snprintf(head, sizeof head, "SIG %.12g %.12g %.12g\n", o.sigma_translation, o.sigma_rotation,
                o.sigma_point);
  out << head;
  const auto count = static_cast<std::int64_t>(tour.poses.size());
  for (std::int64_t i = 0; i < count; ++i) {
    print_pose(out, "GT", i, -1, tour.poses[static_cast<std::size_t>(i)]);
  }
  SE3 guess = tour.poses[0];
  for (std::int64_t i = 0; i < count; ++i) {
    print_pose(out, "INIT", i, -1, guess);
    guess = i + 1 < count ? guess * steps[static_cast<std::size_t>(i)] : guess;
  }
  for (std::size_t j = 0; j < building.planes.size(); ++j) {
    const Plane& p = building.planes[j].plane;
    const double values[4] = {p.normal().x(), p.normal().y(), p.normal().z(), p.rho()};
    print(out, "PLANE", static_cast<std::int64_t>(j), -1, values, 4);
  }
  for (std::int64_t i = 0; i + 1 < count; ++i) {
    print_pose(out, "ODO", i, i + 1, steps[static_cast<std::size_t>(i)]);
  }
  return {count, static_cast<std::int64_t>(building.planes.size()), count - 1,
          print_observations(out, o, building, tour)};
}

PlaneGraphCounts write_plane_graph(const PlaneGraphOptions& options,
                                   const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  const PlaneGraphCounts counts = write_plane_graph(options, out);
  out.close();
  if (!out) {
    throw input_error(file.string(), "", "a file that cannot be written", "a writable folder");
  }
  return counts;
}

}  // namespace lamina::sim
