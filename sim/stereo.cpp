// Paints depth images with a solid noise texture.
#include <lamina/sim/stereo.hpp>

#include <algorithm>
#include <cmath>

namespace lamina::sim {
namespace {

constexpr std::uint64_t kTextureStream = 0x7E87E87E8ULL;
constexpr std::uint64_t kPixelStream = 0x51E2E00000000000ULL;

double lattice(std::int64_t x, std::int64_t y, std::int64_t z, std::uint64_t key) {
  std::uint64_t h = key ^ (static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15ULL);
  h = (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9ULL + static_cast<std::uint64_t>(y);
  h = (h ^ (h >> 32)) * 0x94D049BB133111EBULL + static_cast<std::uint64_t>(z);
  h = (h ^ (h >> 29)) * 0xD6E8FEB86659FD93ULL;
  return static_cast<double>((h ^ (h >> 32)) >> 11) * 0x1.0p-53;
}

/// Trilinear value noise in [0, 1].
double value_noise(const Eigen::Vector3d& p, std::uint64_t key) {
  const Eigen::Vector3d base = p.array().floor(), f = p - base;
  const auto x = static_cast<std::int64_t>(base.x()), y = static_cast<std::int64_t>(base.y()),
             z = static_cast<std::int64_t>(base.z());
  double sum = 0;
  for (int k = 0; k < 8; ++k) {
    const int dx = k & 1, dy = (k >> 1) & 1, dz = (k >> 2) & 1;
    sum += (dx ? f.x() : 1 - f.x()) * (dy ? f.y() : 1 - f.y()) * (dz ? f.z() : 1 - f.z()) *
           lattice(x + dx, y + dy, z + dz, key);
  }
  return sum;
}

}  // namespace

double texture_at(const Eigen::Vector3d& point_map, double footprint, std::uint64_t seed) {
  // Wavelengths of 1.28 m down to 5 mm; one fades out between 4 and 2 pixels.
  double sum = 0, weight = 0, wavelength = 1.28;
  for (std::uint64_t octave = 0; octave < 9; ++octave, wavelength /= 2) {
    const double fade = std::clamp(0.5 * (wavelength / footprint - 2), 0.0, 1.0);
    if (fade <= 0) {
      break;
    }
    const std::uint64_t key = random_bits(seed, kTextureStream, octave);
    // An offset keeps the lattice of one octave off the faces and off that of the others.
    const Eigen::Vector3d at = point_map / wavelength + Eigen::Vector3d::Constant(0.37 + octave);
    sum += fade * (value_noise(at, key) - 0.5);
    weight += fade * fade;
  }
  return std::clamp(0.5 + 0.9 * sum / std::sqrt(std::max(weight, 1e-9)), 0.0, 1.0);
}

StereoRenderer::StereoRenderer(const Caster& caster, const StereoCamera& camera, double pixel_noise,
                               std::uint64_t seed)
    : camera_(camera),
      pixel_noise_(pixel_noise),
      seed_(seed),
      depth_(caster, DepthCamera{camera.camera, 1000, {}}, DepthEffects::none(), seed) {}

std::vector<std::uint8_t> StereoRenderer::paint(const DepthTruth& truth, const SE3& T_map_camera,
                                                std::uint64_t stream) const {
  const CameraModel& c = camera_.camera;
  std::vector<std::uint8_t> image(truth.inverse_depth.size());
  std::vector<float> noise(image.size());
  normals_.fill(seed_, stream, noise);
  for (int v = 0; v < truth.height; ++v) {
    for (int u = 0; u < truth.width; ++u) {
      const std::size_t i = truth.index(u, v);
      double grey = 0.5;
      if (truth.surface[i] >= 0) {
        const double z = 1 / static_cast<double>(truth.inverse_depth[i]);
        const Eigen::Vector3d point_camera((u - c.cx) * z / c.fx, (v - c.cy) * z / c.fy, z);
        grey = texture_at(T_map_camera * point_camera, z / c.fx, seed_);
      }
      const double level = 20 + 215 * grey + pixel_noise_ * static_cast<double>(noise[i]);
      image[i] = static_cast<std::uint8_t>(std::clamp(std::floor(level + 0.5), 0.0, 255.0));
    }
  }
  return image;
}

StereoFrame StereoRenderer::measure(const DepthTruth& left, const SE3& T_map_left, Timestamp stamp,
                                    std::uint64_t frame_index) const {
  StereoFrame pair;
  pair.stamp = stamp;
  pair.camera = camera_;
  const SE3 T_map_right = T_map_left * SE3::from_translation({camera_.baseline, 0, 0});
  pair.left = paint(left, T_map_left, kPixelStream + 2 * frame_index);
  pair.right = paint(depth_.truth(T_map_right), T_map_right, kPixelStream + 2 * frame_index + 1);
  return pair;
}

}  // namespace lamina::sim
