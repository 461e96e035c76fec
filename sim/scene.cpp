// Builds scenes from polygons, boxes, holes and ramps.
#include <lamina/sim/scene.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina::sim {
namespace {

using Corners = std::vector<Eigen::Vector3d>;

/// Twice the area times the normal (Newell).
Eigen::Vector3d area_vector(const Corners& corners) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    sum += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  }
  return sum;
}

Corners rectangle_at(const Rect& r, double z) {
  return {{r.x0, r.y0, z}, {r.x1, r.y0, z}, {r.x1, r.y1, z}, {r.x0, r.y1, z}};
}

bool inside_any(const std::vector<Rect>& openings, double x, double y) {
  return std::any_of(openings.begin(), openings.end(),
                     [&](const Rect& r) { return x > r.x0 && x < r.x1 && y > r.y0 && y < r.y1; });
}

Corners moved(const SE3& T_map_part, Corners corners) {
  for (Eigen::Vector3d& corner : corners) {
    corner = T_map_part * corner;
  }
  return corners;
}

std::vector<double> cuts(double low, double high, const std::vector<double>& at) {
  std::vector<double> all = {low, high};
  for (double value : at) {
    if (value > low && value < high) {
      all.push_back(value);
    }
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

}  // namespace

int Scene::add_polygon(const std::string& name, PlaneLabel label, const Corners& corners_map) {
  const Eigen::Vector3d area =
      corners_map.size() < 3 ? Eigen::Vector3d(0, 0, 0) : area_vector(corners_map);
  if (!(area.norm() > 1e-12)) {
    throw input_error("scene", name, "a polygon without area", "at least three corners");
  }
  const Eigen::Vector3d normal = area.normalized();
  const Plane plane(normal, normal.dot(corners_map[0]));
  for (const Eigen::Vector3d& corner : corners_map) {
    if (std::abs(plane.signed_distance(corner)) > 1e-6) {
      throw input_error("scene", name, "corners that are not in one plane", "a flat polygon");
    }
  }
  const int id = static_cast<int>(planes_.size());
  planes_.push_back({id, name, label, plane, corners_map, {}, 0.5 * area.norm()});
  faces_.push_back({id, plane, corners_map});
  return id;
}

int Scene::add_rectangle(const std::string& name, PlaneLabel label, const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
  return add_polygon(name, label, {origin, origin + u, origin + u + v, origin + v});
}

int Scene::add_ground(const std::string& name, PlaneLabel label, const Rect& area, double z,
                      const std::vector<Rect>& openings) {
  const int id = add_polygon(name, label, rectangle_at(area, z));
  if (openings.empty()) {
    return id;
  }
  const Plane plane = planes_.back().plane_map;
  faces_.pop_back();
  std::vector<double> xs, ys;
  for (const Rect& r : openings) {
    xs.insert(xs.end(), {r.x0, r.x1});
    ys.insert(ys.end(), {r.y0, r.y1});
    Corners rim = rectangle_at(r, z);
    planes_.back().holes_map.push_back(rim);
  }
  xs = cuts(area.x0, area.x1, xs);
  ys = cuts(area.y0, area.y1, ys);
  double left = 0;
  for (std::size_t j = 0; j + 1 < ys.size(); ++j) {
    for (std::size_t i = 0; i + 1 < xs.size(); ++i) {
      if (inside_any(openings, 0.5 * (xs[i] + xs[i + 1]), 0.5 * (ys[j] + ys[j + 1]))) {
        continue;
      }
      // Neighbours in the row join, so that a hole costs four faces and not eight.
      const double x0 = xs[i];
      while (i + 2 < xs.size() &&
             !inside_any(openings, 0.5 * (xs[i + 1] + xs[i + 2]), 0.5 * (ys[j] + ys[j + 1]))) {
        ++i;
      }
      const Rect piece{x0, ys[j], xs[i + 1], ys[j + 1]};
      faces_.push_back({id, plane, rectangle_at(piece, z)});
      left += (piece.x1 - piece.x0) * (piece.y1 - piece.y0);
    }
  }
  planes_.back().area = left;
  return id;
}

int Scene::add_terrain(const std::string& name, PlaneLabel label, const Rect& area, double cell,
                       const std::function<double(double x, double y)>& height) {
  const int id = add_polygon(name, label, rectangle_at(area, 0));
  faces_.pop_back();
  const auto facet = [&](const Corners& corners) {
    const Eigen::Vector3d normal = area_vector(corners).normalized();
    faces_.push_back({id, Plane(normal, normal.dot(corners[0])), corners});
  };
  const int columns = std::max(1, static_cast<int>(std::lround((area.x1 - area.x0) / cell)));
  const int rows = std::max(1, static_cast<int>(std::lround((area.y1 - area.y0) / cell)));
  const auto corner = [&](int i, int j) {
    const double x = area.x0 + (area.x1 - area.x0) * i / columns;
    const double y = area.y0 + (area.y1 - area.y0) * j / rows;
    return Eigen::Vector3d(x, y, height(x, y));
  };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      facet({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
      facet({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  }
  return id;
}

void Scene::add_box(const std::string& name, const SE3& T_map_box, const Eigen::Vector3d& size,
                    PlaneLabel top, PlaneLabel sides) {
  const double x = size.x() / 2, y = size.y() / 2, z = size.z();
  const auto add = [&](const char* part, PlaneLabel label, const Corners& corners_box) {
    add_polygon(name + "." + part, label, moved(T_map_box, corners_box));
  };
  add("top", top, {{-x, -y, z}, {x, -y, z}, {x, y, z}, {-x, y, z}});
  add("bottom", PlaneLabel::kOther, {{-x, -y, 0}, {-x, y, 0}, {x, y, 0}, {x, -y, 0}});
  add("front", sides, {{x, -y, 0}, {x, y, 0}, {x, y, z}, {x, -y, z}});
  add("back", sides, {{-x, -y, 0}, {-x, -y, z}, {-x, y, z}, {-x, y, 0}});
  add("left", sides, {{-x, y, 0}, {-x, y, z}, {x, y, z}, {x, y, 0}});
  add("right", sides, {{-x, -y, 0}, {x, -y, 0}, {x, -y, z}, {-x, -y, z}});
}

int Scene::add_wall(const std::string& name, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                    double z0, double z1) {
  return add_polygon(name, PlaneLabel::kWall,
                     {{to.x(), to.y(), z0},
                      {from.x(), from.y(), z0},
                      {from.x(), from.y(), z1},
                      {to.x(), to.y(), z1}});
}

void Scene::add_hole_walls(const std::string& name, const Rect& r, double z, double thickness) {
  const Eigen::Vector2d corner[4] = {{r.x0, r.y0}, {r.x1, r.y0}, {r.x1, r.y1}, {r.x0, r.y1}};
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d a = corner[i], b = corner[(i + 1) % 4];
    add_wall(name + ".wall" + std::to_string(i), a, b, z - thickness, z);
    add_hole_edge({{a.x(), a.y(), z}, {b.x(), b.y(), z}});
  }
}

void Scene::add_ramp(const std::string& name, const SE3& T_map_ramp, double length, double width,
                     double rise) {
  const double w = width / 2, l = length;
  const auto add = [&](const char* part, PlaneLabel label, const Corners& corners_ramp) {
    add_polygon(name + "." + part, label, moved(T_map_ramp, corners_ramp));
  };
  add("slope", PlaneLabel::kRamp, {{0, -w, 0}, {l, -w, rise}, {l, w, rise}, {0, w, 0}});
  add("right", PlaneLabel::kOther, {{0, -w, 0}, {l, -w, 0}, {l, -w, rise}});
  add("left", PlaneLabel::kOther, {{0, w, 0}, {l, w, rise}, {l, w, 0}});
  add("back", PlaneLabel::kOther, {{l, -w, 0}, {l, w, 0}, {l, w, rise}, {l, -w, rise}});
}

void Scene::add_house(const std::string& name, const House& h) {
  constexpr double kDegree = 3.14159265358979323846 / 180;
  const SE3 T_map_house = SE3::planar(h.x, h.y, h.yaw_deg * kDegree);
  const double l = h.length / 2, w = h.width / 2, e = h.eaves;
  const double top = e + w * std::tan(h.pitch_deg * kDegree);
  const auto add = [&](const char* part, PlaneLabel label, const Corners& corners_house) {
    add_polygon(name + "." + part, label, moved(T_map_house, corners_house));
  };
  add("roof.right", PlaneLabel::kOther, {{-l, -w, e}, {l, -w, e}, {l, 0, top}, {-l, 0, top}});
  add("roof.left", PlaneLabel::kOther, {{l, w, e}, {-l, w, e}, {-l, 0, top}, {l, 0, top}});
  add("wall.right", PlaneLabel::kWall, {{-l, -w, 0}, {l, -w, 0}, {l, -w, e}, {-l, -w, e}});
  add("wall.left", PlaneLabel::kWall, {{l, w, 0}, {-l, w, 0}, {-l, w, e}, {l, w, e}});
  add("gable.front", PlaneLabel::kWall,
      {{l, -w, 0}, {l, w, 0}, {l, w, e}, {l, 0, top}, {l, -w, e}});
  add("gable.back", PlaneLabel::kWall,
      {{-l, w, 0}, {-l, -w, 0}, {-l, -w, e}, {-l, 0, top}, {-l, w, e}});
}

const ScenePlane* Scene::find(const std::string& name) const {
  const auto it = std::find_if(planes_.begin(), planes_.end(),
                               [&](const ScenePlane& p) { return p.name == name; });
  return it == planes_.end() ? nullptr : &*it;
}

}  // namespace lamina::sim
