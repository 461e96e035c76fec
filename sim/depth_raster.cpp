// The exact depth image: faces by scan conversion, cylinders and meshes by rays.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/sim/depth_camera.hpp>

namespace lamina::sim {
namespace {

constexpr double kNear = 1e-3;  ///< m: what is closer is behind the lens

using Points = std::vector<Eigen::Vector3d>;

/// The part of a polygon with z >= kNear.
void clip_near(const Points& in, Points& out) {
  out.clear();
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Eigen::Vector3d &a = in[i], &b = in[(i + 1) % in.size()];
    const bool a_in = a.z() >= kNear, b_in = b.z() >= kNear;
    if (a_in) {
      out.push_back(a);
    }
    if (a_in != b_in) {
      Eigen::Vector3d cut = a + (kNear - a.z()) / (b.z() - a.z()) * (b - a);
      cut.z() = kNear;
      out.push_back(cut);
    }
  }
}

/// Where a convex polygon in the image meets row v: [low, high], empty when low > high.
void row_span(const std::vector<Eigen::Vector2d>& polygon, double v, double& low, double& high) {
  low = std::numeric_limits<double>::infinity();
  high = -low;
  const std::size_t count = polygon.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[i + 1 == count ? 0 : i + 1];
    if ((a.y() < v && b.y() < v) || (a.y() > v && b.y() > v)) {
      continue;
    }
    if (a.y() == b.y()) {
      low = std::min({low, a.x(), b.x()});
      high = std::max({high, a.x(), b.x()});
    } else {
      const double u = a.x() + (v - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      low = std::min(low, u);
      high = std::max(high, u);
    }
  }
}

void fill_row(float* depth, std::int32_t* surface, int count, double start, double step,
              std::int32_t id) {
  const float w0 = static_cast<float>(start), dw = static_cast<float>(step);
  for (int i = 0; i < count; ++i) {
    const float w = w0 + static_cast<float>(i) * dw;
    const bool nearer = w > depth[i];
    depth[i] = nearer ? w : depth[i];
    surface[i] = nearer ? id : surface[i];
  }
}

/// First and last pixel of an interval, widened by rounding error and cut to [0, size).
std::pair<int, int> pixels(double low, double high, int size) {
  constexpr double kSlack = 1e-7;
  const double first = std::max(0.0, std::ceil(low - kSlack));
  const double last = std::min(size - 1.0, std::floor(high + kSlack));
  return last < first ? std::pair(0, -1)
                      : std::pair(static_cast<int>(first), static_cast<int>(last));
}

}  // namespace

DepthRenderer::Linear DepthRenderer::linear_of(const Plane& plane_camera) const {
  const CameraModel& c = camera_.camera;
  const Eigen::Vector3d n = plane_camera.normal() / plane_camera.rho();
  return {n.x() / c.fx, n.y() / c.fy, n.z() - n.x() * c.cx / c.fx - n.y() * c.cy / c.fy,
          plane_camera.rho()};
}

void DepthRenderer::draw_face(const Face& face, std::int32_t surface, const SE3& T_camera_map,
                              DepthTruth& out) const {
  const Plane plane_camera = T_camera_map * face.plane_map;
  if (std::abs(plane_camera.rho()) < 1e-9) {
    return;  // seen edge on
  }
  Points corners, clipped;
  for (const Eigen::Vector3d& corner : face.corners_map) {
    corners.push_back(T_camera_map * corner);
  }
  clip_near(corners, clipped);
  if (clipped.size() < 3) {
    return;
  }
  const CameraModel& c = camera_.camera;
  std::vector<Eigen::Vector2d> polygon;
  double v_low = std::numeric_limits<double>::infinity(), v_high = -v_low;
  for (const Eigen::Vector3d& p : clipped) {
    polygon.emplace_back(c.fx * p.x() / p.z() + c.cx, c.fy * p.y() / p.z() + c.cy);
    v_low = std::min(v_low, polygon.back().y());
    v_high = std::max(v_high, polygon.back().y());
  }
  const Linear linear = linear_of(plane_camera);
  const auto [first_row, last_row] = pixels(v_low, v_high, out.height);
  for (int v = first_row; v <= last_row; ++v) {
    double low = 0, high = 0;
    row_span(polygon, std::clamp(static_cast<double>(v), v_low, v_high), low, high);
    const auto [first, last] = pixels(low, high, out.width);
    if (last >= first) {
      const std::size_t at = out.index(first, v);
      fill_row(&out.inverse_depth[at], &out.surface[at], last - first + 1,
               linear.at0 + linear.dv * v + linear.du * first, linear.du, surface);
    }
  }
}

void DepthRenderer::draw_cylinder(const Cylinder& cylinder, std::int32_t surface,
                                  const SE3& T_map_camera, DepthTruth& out) const {
  // Pixels of the box around it: exact enough to skip most of the image.
  const CameraModel& c = camera_.camera;
  const SE3 T_camera_map = T_map_camera.inverse();
  const Eigen::Vector3d a = T_camera_map * cylinder.base_map;
  const Eigen::Vector3d b =
      T_camera_map * (cylinder.base_map + cylinder.length * cylinder.axis_map);
  double u0 = 0, u1 = out.width - 1.0, v0 = 0, v1 = out.height - 1.0;
  if (std::max(a.z(), b.z()) + cylinder.radius < kNear) {
    return;
  }
  if (std::min(a.z(), b.z()) - cylinder.radius > 0.05) {
    u0 = v0 = std::numeric_limits<double>::infinity();
    u1 = v1 = -u0;
    for (const Eigen::Vector3d& end : {a, b}) {
      for (int k = 0; k < 8; ++k) {
        const double r = cylinder.radius;
        const Eigen::Vector3d p =
            end + Eigen::Vector3d(k & 1 ? r : -r, k & 2 ? r : -r, k & 4 ? r : -r);
        const double u = c.fx * p.x() / p.z() + c.cx, v = c.fy * p.y() / p.z() + c.cy;
        u0 = std::min(u0, u), u1 = std::max(u1, u), v0 = std::min(v0, v), v1 = std::max(v1, v);
      }
    }
  }
  const auto [first, last] = pixels(u0, u1, out.width);
  const auto [first_row, last_row] = pixels(v0, v1, out.height);
  for (int v = first_row; v <= last_row; ++v) {
    for (int u = first; u <= last; ++u) {
      const Eigen::Vector3d ray((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
      const auto z =
          cast_cylinder(cylinder, T_map_camera.translation(), T_map_camera.so3() * ray, kNear);
      const std::size_t at = out.index(u, v);
      if (z && static_cast<float>(1 / *z) > out.inverse_depth[at]) {
        out.inverse_depth[at] = static_cast<float>(1 / *z);
        out.surface[at] = surface;
      }
    }
  }
}

void DepthRenderer::draw_meshes(const SE3& T_map_camera, DepthTruth& out) const {
  const CameraModel& c = camera_.camera;
  for (int v = 0; v < out.height; ++v) {
    for (int u = 0; u < out.width; ++u) {
      const Eigen::Vector3d ray((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
      const std::size_t at = out.index(u, v);
      const float nearest = out.inverse_depth[at];
      const double limit = nearest > 0 ? 1 / static_cast<double>(nearest) : 1e9;
      const auto hit =
          caster_->cast_meshes(T_map_camera.translation(), T_map_camera.so3() * ray, kNear, limit);
      if (hit) {
        out.inverse_depth[at] = static_cast<float>(1 / hit->range);
        out.surface[at] = hit->surface;
      }
    }
  }
}

DepthTruth DepthRenderer::truth(const SE3& T_map_camera) const {
  DepthTruth out;
  out.width = camera_.camera.width;
  out.height = camera_.camera.height;
  const std::size_t size =
      static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  out.inverse_depth.assign(size, 0.0F);
  out.surface.assign(size, -1);
  const Scene& scene = caster_->scene();
  const SE3 T_camera_map = T_map_camera.inverse();
  std::int32_t surface = 0;
  for (const Face& face : scene.faces()) {
    draw_face(face, surface++, T_camera_map, out);
  }
  for (const Cylinder& cylinder : scene.cylinders()) {
    draw_cylinder(cylinder, surface++, T_map_camera, out);
  }
  if (caster_->has_meshes()) {
    draw_meshes(T_map_camera, out);
  }
  return out;
}

}  // namespace lamina::sim
