// The exact answer to "what does this ray hit?" for planar worlds with cylinders.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <lamina/sim/scene.hpp>

namespace lamina::sim {

/// Numbers of surfaces run on: faces first, then cylinders, then meshes.
struct Hit {
  double range = 0;  ///< in units of the ray's direction
  std::int32_t surface = -1;
  Eigen::Vector3d normal_map = Eigen::Vector3d::UnitZ();  ///< unit, towards the ray's origin
};

/// The triangle meshes of a scene in Embree's hands (mesh_caster.cpp).
class MeshCaster;

/// Analytic ray casting with a bounding volume hierarchy over faces and cylinders. Meshes, where
/// there are any, are asked through Embree. The scene must outlive the caster. Calls from several
/// threads are safe.
class Caster {
 public:
  explicit Caster(const Scene& scene);
  ~Caster();
  Caster(Caster&&) noexcept;
  Caster& operator=(Caster&&) noexcept;

  /// The nearest hit with range in (min_range, max_range); nullopt when there is none.
  std::optional<Hit> cast(const Eigen::Vector3d& origin_map, const Eigen::Vector3d& direction_map,
                          double min_range = 1e-6, double max_range = 1e9) const;
  /// The plane of the truth a surface belongs to; -1 for cylinders, meshes and no surface.
  int plane_of(std::int32_t surface) const;
  const Scene& scene() const { return *scene_; }
  bool has_meshes() const { return meshes_ != nullptr; }
  /// The nearest hit among meshes alone.
  std::optional<Hit> cast_meshes(const Eigen::Vector3d& origin_map,
                                 const Eigen::Vector3d& direction_map, double min_range,
                                 double max_range) const;

 private:
  struct Node {
    Eigen::Array3d low, high;
    std::int32_t left = -1;  ///< children at left and left + 1; -1 marks a leaf
    std::int32_t first = 0, count = 0;
  };
  void build(std::int32_t node, std::vector<Eigen::Array3d>& centers);
  void bound(Node& node) const;
  bool hit_surface(std::int32_t surface, const Eigen::Vector3d& origin,
                   const Eigen::Vector3d& direction, double min_range, Hit& best) const;

  const Scene* scene_;
  std::vector<Node> nodes_;
  std::vector<std::int32_t> order_;           ///< surfaces, leaf by leaf
  std::vector<Eigen::Array3d> lows_, highs_;  ///< bounds of each surface
  std::unique_ptr<MeshCaster> meshes_;
};

/// Range of the ray's hit on a flat convex face, from either side; nullopt when it misses. Points
/// on the border count as inside, so that two faces that share an edge leave no gap.
std::optional<double> cast_face(const Face& face, const Eigen::Vector3d& origin,
                                const Eigen::Vector3d& direction);
/// Nearest range > min_range of the ray's hit on a cylinder's side, from outside or inside.
std::optional<double> cast_cylinder(const Cylinder& cylinder, const Eigen::Vector3d& origin,
                                    const Eigen::Vector3d& direction, double min_range);

}  // namespace lamina::sim
