// Ray casting of triangle meshes with Embree 3.
#include <lamina/sim/mesh_caster.hpp>

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include <lamina/models/error.hpp>

namespace lamina::sim {

struct MeshCaster::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Embree() = default;
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;
  ~Embree() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

MeshCaster::MeshCaster(const std::vector<Mesh>& meshes) : embree_(std::make_unique<Embree>()) {
  // One thread builds the tree: its shape, and so the last bit of a hit, is always the same.
  embree_->device = rtcNewDevice("threads=1,user_threads=1");
  LAMINA_CHECK(embree_->device != nullptr);
  embree_->scene = rtcNewScene(embree_->device);
  rtcSetSceneFlags(embree_->scene, RTC_SCENE_FLAG_ROBUST);
  for (const Mesh& mesh : meshes) {
    RTCGeometry geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), mesh.vertices_map.size()));
    for (std::size_t i = 0; i < mesh.vertices_map.size(); ++i) {
      Eigen::Map<Eigen::Vector3f>(vertices + 3 * i) = mesh.vertices_map[i];
    }
    unsigned* triangles = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), mesh.triangles.size()));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        triangles[3 * i + static_cast<std::size_t>(k)] =
            static_cast<unsigned>(mesh.triangles[i][k]);
      }
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(embree_->scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(embree_->scene);
  LAMINA_CHECK(rtcGetDeviceError(embree_->device) == RTC_ERROR_NONE);
}

MeshCaster::~MeshCaster() = default;

std::optional<Hit> MeshCaster::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                    double min_range, double max_range) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(origin.x());
  ray.ray.org_y = static_cast<float>(origin.y());
  ray.ray.org_z = static_cast<float>(origin.z());
  ray.ray.dir_x = static_cast<float>(direction.x());
  ray.ray.dir_y = static_cast<float>(direction.y());
  ray.ray.dir_z = static_cast<float>(direction.z());
  ray.ray.tnear = static_cast<float>(min_range);
  ray.ray.tfar = static_cast<float>(max_range);
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree_->scene, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
    return std::nullopt;
  }
  Hit hit;
  hit.range = static_cast<double>(ray.ray.tfar);
  hit.surface = static_cast<std::int32_t>(ray.hit.geomID);
  hit.normal_map =
      Eigen::Vector3d(static_cast<double>(ray.hit.Ng_x), static_cast<double>(ray.hit.Ng_y),
                      static_cast<double>(ray.hit.Ng_z))
          .normalized();
  if (hit.normal_map.dot(direction) > 0) {
    hit.normal_map = -hit.normal_map;
  }
  return hit;
}

}  // namespace lamina::sim
