// A world of bounded planes, boxes, holes and cylinders, every plane with its truth.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/models/plane.hpp>

namespace lamina::sim {

/// What is true of one plane. Several faces may share it (a floor with a hole is many rectangles).
struct ScenePlane {
  int id = 0;  ///< its index in Scene::planes()
  std::string name;
  PlaneLabel label = PlaneLabel::kOther;
  Plane plane_map;                           ///< normal to the side it is meant to be seen from
  std::vector<Eigen::Vector3d> outline_map;  ///< counter-clockwise seen from the normal
  std::vector<std::vector<Eigen::Vector3d>> holes_map;  ///< openings in the outline
  double area = 0;                                      ///< m^2, without the openings
};

/// A convex piece of a plane; what rays hit. Visible from both sides.
struct Face {
  int plane_id = 0;
  Plane plane_map;
  std::vector<Eigen::Vector3d> corners_map;  ///< counter-clockwise seen from the normal
};

/// An upright or lying cylinder without its ends (posts, rails, pipes); no plane of the truth.
struct Cylinder {
  std::string name;
  Eigen::Vector3d base_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_map = Eigen::Vector3d::UnitZ();  ///< unit
  double radius = 0.05, length = 1;                     ///< m
};

/// Triangles of a loaded mesh, in the map frame; no plane of the truth.
struct Mesh {
  std::string name;
  std::vector<Eigen::Vector3f> vertices_map;
  std::vector<Eigen::Vector3i> triangles;
};

/// Where floor ends above nothing: the rim of a hole, the top of a stair.
struct HoleEdge {
  Eigen::Vector3d from_map, to_map;
};

/// Axis-parallel rectangle in x and y (m).
struct Rect {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

struct House {
  double x = 0, y = 0, yaw_deg = 0;
  double length = 16, width = 10;    ///< m, along the ridge and across
  double eaves = 4, pitch_deg = 30;  ///< m above ground; of the roof
};

class Scene {
 public:
  /// A flat convex polygon, corners counter-clockwise seen from its visible side. Returns its
  /// plane's id. Throws lamina::Error for fewer than three corners, zero area or corners that lie
  /// off their plane by more than 1e-6 m.
  int add_polygon(const std::string& name, PlaneLabel label,
                  const std::vector<Eigen::Vector3d>& corners_map);
  /// Parallelogram origin, +u, +u+v, +v; the normal is u x v.
  int add_rectangle(const std::string& name, PlaneLabel label, const Eigen::Vector3d& origin,
                    const Eigen::Vector3d& u, const Eigen::Vector3d& v);
  /// Level ground at height z with rectangular openings.
  int add_ground(const std::string& name, PlaneLabel label, const Rect& area, double z,
                 const std::vector<Rect>& openings = {});
  /// Ground of a height (m) that varies: facets of `cell` (m), all of one level plane of the truth.
  int add_terrain(const std::string& name, PlaneLabel label, const Rect& area, double cell,
                  const std::function<double(double x, double y)>& height);
  /// A box standing on the x-y plane of T_map_box, centred there; sides, top and bottom.
  void add_box(const std::string& name, const SE3& T_map_box, const Eigen::Vector3d& size,
               PlaneLabel top = PlaneLabel::kOther, PlaneLabel sides = PlaneLabel::kOther);
  /// The walls of the slab around an opening (thickness m, downwards from z) and its rim in
  /// hole_edges(). The opening itself is add_ground's.
  void add_hole_walls(const std::string& name, const Rect& opening, double z, double thickness);
  /// A vertical wall along a line on the ground, seen from the line's left side.
  int add_wall(const std::string& name, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
               double z0, double z1);
  /// A ramp: rises from height z to z + rise along +x of T_map_ramp over `length`, `width` across;
  /// with its two sides and its back.
  void add_ramp(const std::string& name, const SE3& T_map_ramp, double length, double width,
                double rise);
  /// A gabled building on the ground: two roof planes over a rectangle, ridge along x of its frame,
  /// and four walls.
  void add_house(const std::string& name, const House& house);
  void add_cylinder(const Cylinder& cylinder) { cylinders_.push_back(cylinder); }
  void add_mesh(Mesh mesh) { meshes_.push_back(std::move(mesh)); }
  void add_hole_edge(const HoleEdge& edge) { hole_edges_.push_back(edge); }

  const std::vector<ScenePlane>& planes() const { return planes_; }
  const std::vector<Face>& faces() const { return faces_; }
  const std::vector<Cylinder>& cylinders() const { return cylinders_; }
  const std::vector<Mesh>& meshes() const { return meshes_; }
  const std::vector<HoleEdge>& hole_edges() const { return hole_edges_; }
  /// nullptr when there is none of that name.
  const ScenePlane* find(const std::string& name) const;

 private:
  std::vector<ScenePlane> planes_;
  std::vector<Face> faces_;
  std::vector<Cylinder> cylinders_;
  std::vector<Mesh> meshes_;
  std::vector<HoleEdge> hole_edges_;
};

}  // namespace lamina::sim
