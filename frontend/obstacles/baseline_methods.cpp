// Plain loops over all pixels, as the document's algorithms 1 to 3 are.
#include <lamina/frontend/obstacles/baseline_methods.hpp>

#include <cmath>

namespace lamina {
namespace {

template <class Visit>
void for_each_point(const ScanView& view, const Visit& visit) {
  for (int v = 0; v < view.image->height; ++v) {
    const float* d = view.image->row(v);
    const Eigen::Vector3d first = view.ray(0, v), step = view.R.col(0) / view.fx;
    for (int u = 0; u < view.image->width; ++u) {
      if (!(d[u] > 0)) continue;
      const double z = view.noise.focal_baseline / static_cast<double>(d[u]);
      visit(Eigen::Vector3d(view.t + (first + u * step) * z), z);
    }
  }
}

// Keeps the nearer (or, with `farthest`, the farther) of what a beam holds and this point.
void keep(const ScanView& view, const Eigen::Vector3d& p, double depth, BeamCause cause,
          bool farthest, ObstacleScan& out) {
  const int beam = out.beam_of(std::atan2(p.y(), p.x()));
  const double range = p.head<2>().norm();
  if (beam < 0 || range > out.range_max) return;
  const std::size_t k = static_cast<std::size_t>(beam);
  const double held = static_cast<double>(out.range[k]);
  if (out.cause[k] != BeamCause::kNone && (farthest ? held >= range : held <= range)) return;
  out.range[k] = static_cast<float>(range);
  out.cause[k] = cause;
  out.sigma[k] = static_cast<float>(view.noise.sigma_depth(depth));
}

}  // namespace

void document_positive_scan(const ScanView& view, double tolerance, double robot_height,
                            ObstacleScan& out) {
  for_each_point(view, [&](const Eigen::Vector3d& p, double depth) {
    if (p.z() > tolerance && p.z() < robot_height)
      keep(view, p, depth, BeamCause::kObstacle, false, out);
  });
}

void document_farthest_point(const ScanView& view, double tolerance, ObstacleScan& out) {
  for_each_point(view, [&](const Eigen::Vector3d& p, double depth) {
    if (std::abs(p.z()) <= tolerance) keep(view, p, depth, BeamCause::kLedge, true, out);
  });
  for (std::size_t k = 0; k < out.size(); ++k) {
    if (out.cause[k] == BeamCause::kLedge) out.floor_range[k] = out.range[k];
  }
}

void document_virtual_floor(const ScanView& view, double tolerance, ObstacleScan& out) {
  for_each_point(view, [&](const Eigen::Vector3d& p, double depth) {
    if (p.z() >= -tolerance) return;
    const double share = view.t.z() / (view.t.z() - p.z());
    keep(view, view.t + (p - view.t) * share, depth, BeamCause::kHole, false, out);
  });
}

}  // namespace lamina
