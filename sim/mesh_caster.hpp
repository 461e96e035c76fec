// Triangle meshes through Embree, behind a plain interface.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include <lamina/sim/caster.hpp>

namespace lamina::sim {

/// Casts rays at triangles in single precision. Surface numbers in hits are 0 for the first mesh.
class MeshCaster {
 public:
  explicit MeshCaster(const std::vector<Mesh>& meshes);
  ~MeshCaster();
  std::optional<Hit> cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                          double min_range, double max_range) const;

 private:
  struct Embree;
  std::unique_ptr<Embree> embree_;
};

}  // namespace lamina::sim
