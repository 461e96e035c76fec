// Lines outward, found in homogeneous image coordinates: straight on any pinhole image.
#include <lamina/frontend/obstacles/scan_view.hpp>

#include <algorithm>

namespace lamina {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Keeps the part of [from, to] where a + (b - a) x >= 0.
void clip(double a, double b, double& from, double& to) {
  if (a >= 0 && b >= 0) return;
  if (a < 0 && b < 0) {
    to = from - 1;
    return;
  }
  const double x = a / (a - b);
  if (a < 0) {
    from = std::max(from, x);
  } else {
    to = std::min(to, x);
  }
}

double wrapped(double angle) { return std::remainder(angle, 2 * kPi); }

}  // namespace

ScanView::ScanView(const DepthFrame& frame, const DisparityImage& disparities, const SE3& T)
    : image(&disparities),
      noise(frame.camera.noise),
      fx(frame.camera.camera.fx),
      fy(frame.camera.camera.fy),
      cx(frame.camera.camera.cx),
      cy(frame.camera.camera.cy),
      T_body_camera(T),
      R(T.so3().matrix()),
      t(T.translation()) {
  find_azimuths();
}

void ScanView::find_azimuths() {
  // A camera that sees its own foot sees all around.
  const Eigen::Vector3d down = R.transpose() * Eigen::Vector3d(0, 0, -1);
  if (down.z() > 0) {
    const double u = cx + fx * down.x() / down.z(), v = cy + fy * down.y() / down.z();
    if (u > 0 && v > 0 && u < image->width - 1 && v < image->height - 1) {
      azimuth_from = -kPi;
      azimuth_to = kPi;
      return;
    }
  }
  const Eigen::Vector3d middle = ray(0.5 * image->width, 0.5 * image->height);
  const double heading = std::atan2(middle.y(), middle.x());
  double least = 0, most = 0;
  const auto visit = [&](double u, double v) {
    const Eigen::Vector3d r = ray(u, v);
    const double a = wrapped(std::atan2(r.y(), r.x()) - heading);
    least = std::min(least, a);
    most = std::max(most, a);
  };
  for (int k = 0; k <= 64; ++k) {
    const double u = image->width * k / 64.0 - 0.5, v = image->height * k / 64.0 - 0.5;
    visit(u, -0.5);
    visit(u, image->height - 0.5);
    visit(-0.5, v);
    visit(image->width - 0.5, v);
  }
  azimuth_from = heading + least;
  azimuth_to = heading + most;
}

WalkLine ScanView::line(double azimuth) const {
  WalkLine out;
  out.azimuth = azimuth;
  out.direction = {std::cos(azimuth), std::sin(azimuth)};
  const auto project = [&](const Eigen::Vector3d& direction_body) {
    const Eigen::Vector3d d = R.transpose() * direction_body;
    return Eigen::Vector3d(fx * d.x() + cx * d.z(), fy * d.y() + cy * d.z(), d.z());
  };
  // Directions from straight down (x = 0) to the horizon (x = 1).
  const Eigen::Vector3d a = project({0, 0, -1});
  const Eigen::Vector3d b = project({out.direction.x(), out.direction.y(), 0});
  // Stereo matchers' windows reach over the border at the sides.
  const double margin =
      noise.kind == DepthNoise::Kind::kStereo ? std::floor(0.01 * image->width) : 0;
  const double right = image->width - 1 - margin, bottom = image->height - 1;
  double from = 0, to = 1;
  clip(a.z() - 1e-6, b.z() - 1e-6, from, to);
  clip(a.x() - margin * a.z(), b.x() - margin * b.z(), from, to);
  clip(a.y(), b.y(), from, to);
  clip(right * a.z() - a.x(), right * b.z() - b.x(), from, to);
  clip(bottom * a.z() - a.y(), bottom * b.z() - b.y(), from, to);
  if (!(to > from)) return out;
  const Eigen::Vector3d p = a + (b - a) * from, q = a + (b - a) * to;
  const Eigen::Vector2d start(p.x() / p.z(), p.y() / p.z()), end(q.x() / q.z(), q.y() / q.z());
  const Eigen::Vector2d way = end - start;
  const double length = std::max(std::abs(way.x()), std::abs(way.y()));
  if (!(length >= 1)) return out;
  out.samples = static_cast<int>(length) + 1;
  out.exits_side = end.x() < margin + 1 || end.x() > right - 1;
  out.u0 = static_cast<float>(start.x());
  out.v0 = static_cast<float>(start.y());
  out.du = static_cast<float>(way.x() / length);
  out.dv = static_cast<float>(way.y() / length);
  return out;
}

}  // namespace lamina
