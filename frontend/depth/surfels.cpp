// Surfels of one frame.
#include <lamina/frontend/depth/surfels.hpp>

#include <cmath>
#include <map>
#include <tuple>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

using PatchKey = std::tuple<std::int16_t, int, int>;  // plane, x, y: the order of the result

// Tilt of a patch that its pixels cannot tell is its parent's, give or take (rad).
constexpr double kParentTilt = 0.01;

Surfel surfel_of(const Moments& moments_body, const ExtractedPlane& parent, const NoiseFloor& floor,
                 double side) {
  Surfel s;
  s.normal = parent.plane_body.normal();
  s.center = moments_body.mean();
  s.radius = side / std::sqrt(M_PI);
  const Matrix32d B = Plane::tangent_basis(s.normal);
  Eigen::Matrix2d tilt = B.transpose() * moments_body.scatter() * B;
  tilt.diagonal().array() += 1 / (kParentTilt * kParentTilt);
  const double det = tilt.determinant();
  s.covariance.setZero();
  Eigen::Matrix2d inverse;
  inverse << tilt(1, 1), -tilt(0, 1), -tilt(1, 0), tilt(0, 0);
  s.covariance.topLeftCorner<2, 2>() = inverse / det;
  s.covariance(2, 2) = 1 / moments_body.weight() + floor.sigma_rho * floor.sigma_rho;
  s.covariance.diagonal().head<2>().array() += floor.sigma_tilt * floor.sigma_tilt;
  return s;
}

}  // namespace

void make_surfels(const PlaneExtractor& extractor, const FloorOptions& options,
                  FloorResult& result) {
  const BlockImage& blocks = extractor.blocks();
  const auto labels = extractor.regions().labels();
  const DisparityGeometry& g = extractor.geometry();
  const Eigen::Matrix3d R = result.T_body_camera.so3().matrix();
  const Eigen::Vector3d t = result.T_body_camera.translation();
  std::map<PatchKey, DisparitySums> patches;
  for (std::size_t i = 0; i < blocks.blocks.size(); ++i) {
    if (labels[i] < 0) continue;
    const PlaneKind kind = result.planes[static_cast<std::size_t>(labels[i])].kind;
    if (kind != PlaneKind::kDominantFloor && kind != PlaneKind::kSubDominant) continue;
    const Block& b = blocks.blocks[i];
    const Eigen::Vector3d p = R * g.point(b.u, b.v, b.d) + t;
    const double reach = 1.25 * options.roi_m[0];
    if (!(p.x() >= -reach && p.x() <= reach && std::abs(p.y()) <= reach)) continue;
    patches[{labels[i], to_cell(p.x() / options.surfel_m), to_cell(p.y() / options.surfel_m)}] +=
        b.sums();
  }
  const double shared = std::sqrt(extractor.noise().shared);
  for (const auto& [key, sums] : patches) {
    const ExtractedPlane& parent = result.planes[static_cast<std::size_t>(std::get<0>(key))];
    const auto moments = sums.moments(g, parent.plane_camera, extractor.noise().per_pixel);
    if (!moments || moments->count() < 64) continue;
    const double z = g.focal_baseline * sums.n / std::max(1e-9, sums.d);
    NoiseFloor floor;
    floor.sigma_rho = std::abs(parent.plane_camera.rho()) * z / g.focal_baseline * shared;
    floor.sigma_tilt = parent.floor.sigma_tilt;
    result.floor_patches.push_back({*moments, floor});
    Surfel s =
        surfel_of(moments->transformed(result.T_body_camera), parent, floor, options.surfel_m);
    s.parent_plane = std::get<0>(key);
    result.surfels_body.push_back(s);
  }
}

}  // namespace lamina
