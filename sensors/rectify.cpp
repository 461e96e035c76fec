// Lens distortion by lookup.
#include <lamina/sensors/rectify.hpp>

#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {

Eigen::Vector2d distort_pixel(const CameraModel& camera, double u, double v) {
  if (!camera.distortion) return {u, v};
  const auto& [k1, k2, p1, p2, k3] = *camera.distortion;
  const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  return {camera.fx * xd + camera.cx, camera.fy * yd + camera.cy};
}

Rectifier::Rectifier(const CameraModel& camera) : width_(camera.width), height_(camera.height) {
  if (!camera.distortion) return;
  const auto size = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  nearest_.reserve(size);
  position_.reserve(size);
  for (int v = 0; v < height_; ++v) {
    for (int u = 0; u < width_; ++u) {
      const Eigen::Vector2d p = distort_pixel(camera, u, v);
      const bool inside = p.x() > -0.5 && p.x() < width_ - 0.5 && p.y() > -0.5 &&
                          p.y() < height_ - 0.5;  // false for NaN, too
      const auto index = inside ? std::lround(p.y()) * width_ + std::lround(p.x()) : -1L;
      nearest_.push_back(static_cast<std::int32_t>(index));
      position_.push_back(inside ? Eigen::Vector2f(p.cast<float>()) : Eigen::Vector2f(0, 0));
    }
  }
}

std::vector<std::uint16_t> Rectifier::depth(const std::vector<std::uint16_t>& raw) const {
  if (!needed()) return raw;
  LAMINA_CHECK(raw.size() == nearest_.size());
  std::vector<std::uint16_t> result(raw.size());
  for (std::size_t i = 0; i < raw.size(); ++i) {
    result[i] = nearest_[i] < 0 ? std::uint16_t{0} : raw[static_cast<std::size_t>(nearest_[i])];
  }
  return result;
}

std::vector<std::uint8_t> Rectifier::grey(const std::vector<std::uint8_t>& image) const {
  if (!needed()) return image;
  LAMINA_CHECK(image.size() == nearest_.size());
  std::vector<std::uint8_t> result(image.size());
  const auto at = [&](int u, int v) {
    const int uu = std::clamp(u, 0, width_ - 1), vv = std::clamp(v, 0, height_ - 1);
    return static_cast<float>(image[static_cast<std::size_t>(vv * width_ + uu)]);
  };
  for (std::size_t i = 0; i < image.size(); ++i) {
    if (nearest_[i] < 0) continue;
    const float x = position_[i].x(), y = position_[i].y();
    const int u = static_cast<int>(std::floor(x)), v = static_cast<int>(std::floor(y));
    const float a = x - static_cast<float>(u), b = y - static_cast<float>(v);
    const float top = (1 - a) * at(u, v) + a * at(u + 1, v);
    const float bottom = (1 - a) * at(u, v + 1) + a * at(u + 1, v + 1);
    result[i] = static_cast<std::uint8_t>(std::lround((1 - b) * top + b * bottom));
  }
  return result;
}

CameraModel undistorted(CameraModel camera) {
  camera.distortion.reset();
  return camera;
}

}  // namespace lamina
