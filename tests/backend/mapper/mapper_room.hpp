// A made-up room, what sensors see of it, and laps in it with odometry that drifts.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include <lamina/backend/mapper/mapper.hpp>

namespace lamina::made_up {

// A rectangle of surface: plane, middle and half extents along the plane's tangent basis.
struct Panel {
  Plane plane;
  Eigen::Vector3d middle;
  Eigen::Vector2d half;
};

inline std::vector<Panel> make_room() {
  return {{Plane({0, 0, 1}, 0), {0, 0, 0}, {5, 3}},
          {Plane({-1, 0, 0}, -5), {5, 0, 1.25}, {1.25, 3}},
          {Plane({1, 0, 0}, -5), {-5, 0, 1.25}, {1.25, 3}},
          {Plane({0, -1, 0}, -3), {0, 3, 1.25}, {5, 1.25}},
          {Plane({0, 1, 0}, -3), {0, -3, 1.25}, {5, 1.25}},
          {Plane({0, -1, 0}, -1), {3.5, 1, 0.5}, {0.6, 0.5}}};
}

class Sensor {
 public:
  explicit Sensor(unsigned seed) : rng_(seed) {}
  double gauss(double sigma) { return sigma * normal_(rng_); }

  // A depth camera's view of every panel in front of the body within 6 m.
  Observations depth(const SE3& T_map_body, Timestamp stamp, const std::vector<Panel>& panels) {
    Observations o;
    o.stamp = stamp;
    o.sensor = SensorKind::kDepth;
    for (const auto& panel : panels) {
      std::vector<Eigen::Vector3d> points;
      const auto corners = visible(panel, T_map_body, points);
      if (points.size() < 30) continue;
      PlaneObservation p;
      const Plane body = T_map_body.inverse() * panel.plane;
      for (const auto& x : points) {
        p.moments_sensor.add(T_map_body.inverse() * x + gauss(0.005) * body.normal(), 1 / 2.5e-5);
      }
      const auto fit = p.moments_sensor.fit_plane(Eigen::Vector3d(0, 0, 0.5), 1.0);
      if (!fit) continue;
      p.plane_sensor = fit->plane;
      p.floor = {0.001, 0.0005};
      for (const auto& c : corners) p.outline_sensor.push_back(T_map_body.inverse() * c);
      if (panel.plane.normal().z() > 0.9) p.kind = PlaneKind::kDominantFloor;
      o.planes.push_back(p);
    }
    return o;
  }

  // A scanner half a metre up: segments of the walls.
  Observations scan(const SE3& T_map_body, Timestamp stamp, const std::vector<Panel>& panels) {
    Observations o;
    o.stamp = stamp;
    o.T_body_sensor = SE3::from_translation({0, 0, 0.5});
    const SE3 T_map_sensor = T_map_body * o.T_body_sensor;
    for (const auto& panel : panels) {
      if (std::abs(panel.plane.normal().z()) > 0.5) continue;
      const Eigen::Vector3d along = panel.plane.normal().cross(Eigen::Vector3d::UnitZ());
      const double half = std::abs(along.x()) > 0.5 ? std::max(panel.half.x(), panel.half.y()) : 3;
      if (panel.middle.z() + 0.5 < 0.5 ||
          panel.plane.signed_distance(T_map_sensor.translation()) < 0.2) {
        continue;
      }
      SegmentObservation s;
      const Eigen::Vector3d n_sensor = T_map_sensor.so3().inverse() * panel.plane.normal();
      for (double u = -half; u <= half; u += 0.05) {
        Eigen::Vector3d x = panel.middle + u * along;
        x.z() = T_map_sensor.translation().z();
        const Eigen::Vector3d seen = T_map_sensor.inverse() * x + gauss(0.01) * n_sensor;
        s.segment.moments.add({seen.x(), seen.y(), 0}, 1e4);
        if (u == -half) s.segment.start = seen.head<2>();
        s.segment.end = seen.head<2>();
      }
      const auto line = s.segment.moments.fit_line();
      if (!line) continue;
      Eigen::Vector3d n(-line->direction.y(), line->direction.x(), 0);
      if (n.dot(s.segment.moments.mean()) < 0) n = -n;  // away from the scanner
      s.segment.theta = std::atan2(n.y(), n.x());
      s.segment.rho = n.dot(s.segment.moments.mean());
      s.segment.count = static_cast<int>(s.segment.moments.count());
      s.floor = {0.002, 0.0005};
      o.segments.push_back(s);
    }
    return o;
  }

 private:
  static std::vector<Eigen::Vector3d> visible(const Panel& panel, const SE3& T_map_body,
                                              std::vector<Eigen::Vector3d>& points) {
    const Matrix32d B = panel.plane.tangent_basis();
    std::vector<Eigen::Vector2d> flat;
    if (panel.plane.signed_distance(T_map_body * Eigen::Vector3d(0, 0, 0.5)) < 0.1) return {};
    for (double u = -panel.half.x(); u <= panel.half.x(); u += 0.1) {
      for (double v = -panel.half.y(); v <= panel.half.y(); v += 0.1) {
        const Eigen::Vector3d x = panel.middle + B * Eigen::Vector2d(u, v);
        const Eigen::Vector3d body = T_map_body.inverse() * x;
        if (body.x() < 0.5 || body.x() > 6 || std::abs(body.y()) > 0.7 * body.x()) continue;
        points.push_back(x);
        flat.emplace_back(u, v);
      }
    }
    std::vector<Eigen::Vector3d> corners;
    if (const auto hull = Polygon::convex_hull(flat)) {
      for (const auto& v : hull->vertices()) corners.push_back(panel.middle + B * v);
    }
    return corners;
  }

  std::mt19937 rng_;
  std::normal_distribution<double> normal_;
};

// Floor from 1 to 3 m ahead, in patches of 10 cm.
inline void add_floor(Observations& o, Sensor& sensor) {
  for (double x = 1; x < 3; x += 0.1) {
    for (double y = -0.5; y < 0.5; y += 0.1) {
      FloorPatch patch;
      for (int k = 0; k < 9; ++k) {
        patch.moments_sensor.add({x + 0.03 * (k % 3), y + 0.03 * (k / 3), sensor.gauss(0.003)},
                                 1e5);
      }
      o.floor_patches.push_back(patch);
    }
  }
}

// Laps of an ellipse, four frames a keyframe, odometry that drifts.
struct Drive {
  std::vector<SE3> truth;
  std::vector<SE3> increments;  // as odometry tells them
  Matrix6d covariance = Matrix6d::Zero();

  Drive(int frames, int frames_a_lap, unsigned seed, double bias_yaw = 0) {
    Sensor noise(seed);
    const double st = 0.003, sr = 0.002;
    covariance.diagonal() << st * st, st * st, 1e-8, 1e-8, 1e-8, sr * sr;
    for (int i = 0; i < frames; ++i) {
      const double a = 2 * M_PI * i / frames_a_lap;
      truth.push_back(
          SE3::planar(2 * std::sin(a), 1 - std::cos(a), std::atan2(std::sin(a), 2 * std::cos(a))));
    }
    for (int i = 1; i < frames; ++i) {
      Vector6d e = Vector6d::Zero();
      e << noise.gauss(st), noise.gauss(st), 0, 0, 0, noise.gauss(sr) + bias_yaw;
      increments.push_back(truth[i - 1].inverse() * truth[i] * SE3::exp(e));
    }
  }
};

inline double ate(const Trajectory& path, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    sum += (path[i].pose.translation() - truth[i].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(path.size()));
}

inline Timestamp at_frame(std::size_t i) {
  return Timestamp::from_nanoseconds(100000000LL * std::int64_t(i));
}

template <class See>
Mapper run(const Drive& drive, const MapperOptions& options, See see) {
  Mapper mapper(options);
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    mapper.add(see(i), i == 0 ? drive.truth[0] : drive.increments[i - 1], drive.covariance);
  }
  return mapper;
}

// Two laps in which old planes are not recognised while mapping: every wall stands twice.
inline Mapper doubled(unsigned seed, const std::vector<Panel>& room) {
  const Drive drive(360, 180, seed);
  Sensor sensor(seed + 100);
  MapperOptions options;
  options.place.enabled = false;
  options.window.keyframes = 8;
  options.association.max_distance_m = 0.02;  // planes beyond the window are sure to 4 mm or new
  return run(drive, options,
             [&](std::size_t i) { return sensor.depth(drive.truth[i], at_frame(i), room); });
}

inline std::size_t panel_of(const MapPlane& plane, const std::vector<Panel>& room) {
  std::size_t best = room.size();
  double least = 0.05;
  for (std::size_t k = 0; k < room.size(); ++k) {
    if (angle_between(room[k].plane, plane.plane_map) > 0.05) continue;
    const double off = std::abs(room[k].plane.signed_distance(plane.centroid_map));
    if (off < least) {
      least = off;
      best = k;
    }
  }
  return best;
}

// A slab of 4 cm before a wall, and a second cupboard in line with the first, 2 m away.
inline std::vector<Panel> make_room_with_slab() {
  auto room = make_room();
  room.push_back({Plane({0, 1, 0}, -2.96), {2, -2.96, 0.6}, {0.8, 0.5}});
  room.push_back({Plane({0, -1, 0}, -1), {-3.5, 1, 0.5}, {0.6, 0.5}});
  return room;
}

// What refining makes of planes that stand twice in make_room_with_slab().
struct Doubles {
  int before = 0, left = 0;
  int wrong = 0;    // panels whose plane went into another's
  int strange = 0;  // planes that are on no panel, before and after

  void refine(Mapper& mapper) {
    const std::vector<int> were = planes_on_panels(mapper);
    mapper.refine();
    const std::vector<int> are = planes_on_panels(mapper);
    for (std::size_t k = 0; k + 1 < are.size(); ++k) {
      before += std::max(0, were[k] - 1);
      left += std::max(0, are[k] - 1);
      wrong += were[k] > 0 && are[k] == 0 ? 1 : 0;
    }
    strange += were.back() + are.back();
  }

 private:
  // By panel; the last: on none.
  static std::vector<int> planes_on_panels(const Mapper& mapper) {
    const auto room = make_room_with_slab();
    std::vector<int> seen(room.size() + 1, 0);
    for (const auto& plane : mapper.map().planes) ++seen[panel_of(plane, room)];
    return seen;
  }
};

}  // namespace lamina::made_up
