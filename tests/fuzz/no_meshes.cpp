// What the drawn worlds do without: Embree and PCL.
#include <lamina/frontend/depth/cloud_planes.hpp>
#include <lamina/sim/mesh_caster.hpp>

namespace lamina {

void CloudPlanes::process(const CloudFrame&, FloorJudge&, FloorResult&) {}

namespace sim {

struct MeshCaster::Embree {};
MeshCaster::MeshCaster(const std::vector<Mesh>&) {}
MeshCaster::~MeshCaster() = default;
std::optional<Hit> MeshCaster::cast(const Eigen::Vector3d&, const Eigen::Vector3d&, double,
                                    double) const {
  return std::nullopt;
}

}  // namespace sim
}  // namespace lamina
