// Means and planes of pixel blocks, in disparity.
#include <lamina/frontend/motion/depth_blocks.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace lamina {
namespace {

/// Mean disparity per block; 0 where too little was measured or an edge runs through.
std::vector<float> mean_disparities(const DepthFrame& frame, const DepthBlockOptions& options,
                                    int n, int width, int height) {
  const DepthNoise& noise = frame.camera.noise;
  const double least = noise.disparity(options.max_depth);
  const auto spread =
      static_cast<float>(options.edge_sigmas * noise.disparity_sigma + 2 * noise.disparity_step);
  const auto scaled = static_cast<float>(noise.focal_baseline * frame.camera.depth_scale);
  const auto lowest = static_cast<float>(least);
  // A surface seen at a slant spreads over a block by its slope times the block's angle.
  const auto slant = static_cast<float>(options.max_slope * n / frame.camera.camera.fx);
  std::vector<float> result(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      float sum = 0, low = 1e30F, high = 0;
      int count = 0;
      for (int y = v * n; y < (v + 1) * n; ++y) {
        const std::uint16_t* row =
            &frame.raw[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width()) +
                       static_cast<std::size_t>(u * n)];
        for (int x = 0; x < n; ++x) {
          if (row[x] == 0) continue;
          const float d = scaled / static_cast<float>(row[x]);
          sum += d;
          low = std::min(low, d);
          high = std::max(high, d);
          ++count;
        }
      }
      if (count == 0 || 2 * count < n * n || high - low > spread + slant * high) continue;
      const float mean = sum / static_cast<float>(count);
      if (mean < lowest) continue;
      result[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
             static_cast<std::size_t>(u)] = mean;
    }
  }
  return result;
}

// Without its blocks.
DepthBlocks image_of_blocks(const CameraModel& camera, int side, int width, int height) {
  DepthBlocks result;
  result.width = width / side;
  result.height = height / side;
  const double n = side, middle = 0.5 * (n - 1);
  result.fx = camera.fx / n;
  result.fy = camera.fy / n;
  result.cx = (camera.cx - middle) / n;
  result.cy = (camera.cy - middle) / n;
  return result;
}

// 1-sigma of a block's mean disparity.
double mean_sigma(const DepthNoise& noise, int side) {
  const double n = side;
  const double samples = std::max(1.0, n * n / noise.pixels_per_sample());
  return std::sqrt(noise.disparity_sigma * noise.disparity_sigma / samples +
                   noise.disparity_step * noise.disparity_step / 12);
}

// d - d0 = a du + b dv + c over the neighbours: normal equations of three unknowns.
struct NeighbourSums {
  double suu = 0, suv = 0, svv = 0, su = 0, sv = 0, sd = 0, sud = 0, svd = 0, sdd = 0;
  int count = 0;
  void add(double du, double dv, double dd) {
    suu += du * du;
    suv += du * dv;
    svv += dv * dv;
    su += du;
    sv += dv;
    sd += dd;
    sud += du * dd;
    svd += dv * dd;
    sdd += dd * dd;
    ++count;
  }
};

struct BlockMeans {
  int width, height;
  std::vector<float> disparity;  // 0: none
  float at(int u, int v) const { return disparity[static_cast<std::size_t>(v * width + u)]; }
};

NeighbourSums neighbour_sums(const BlockMeans& means, int u, int v, int reach) {
  NeighbourSums sums;
  const float d0 = means.at(u, v), near = 0.1F * d0;
  for (int j = std::max(0, v - reach); j <= std::min(means.height - 1, v + reach); ++j) {
    for (int i = std::max(0, u - reach); i <= std::min(means.width - 1, u + reach); ++i) {
      const float d1 = means.at(i, j);
      if (d1 <= 0 || std::abs(d1 - d0) > near) continue;
      sums.add(i - u, j - v, static_cast<double>(d1 - d0));
    }
  }
  return sums;
}

// Planes through blocks and their neighbours, in disparity.
struct NormalFit {
  const DepthBlockOptions& options;
  double fx, fy;          // of the image of blocks
  double focal_baseline;  // px m
  double sigma_d;         // px, of a block's mean

  // Of a block of disparity d0 at (x, y) of the normalised image, where a plane fits.
  void orient(const NeighbourSums& sums, double d0, const Eigen::Vector2d& xy,
              DepthBlock& b) const {
    const int side = 2 * options.reach + 1;
    if (sums.count < side * side * 2 / 3) return;
    Eigen::Matrix3d A;
    A << sums.suu, sums.suv, sums.su, sums.suv, sums.svv, sums.sv, sums.su, sums.sv, sums.count;
    const Eigen::Vector3d rhs(sums.sud, sums.svd, sums.sd);
    const Eigen::Vector3d fit = A.inverse() * rhs;
    const double rms = std::sqrt(std::max(0.0, sums.sdd - fit.dot(rhs)) / (sums.count - 3));
    if (!(rms < options.flat_sigmas * sigma_d + 0.002 * d0)) return;
    // The fitted disparity is better than the block's own.
    const double d = d0 + fit.z();
    const double a = fit.x() * fx, c = fit.y() * fy;
    const Eigen::Vector3d slopes(a, c, d - a * xy.x() - c * xy.y());
    const Eigen::Vector3d normal = -slopes.normalized();
    const Eigen::Vector3d ray(xy.x(), xy.y(), 1);
    const double z = focal_baseline / d;
    b.point = (z * ray).cast<float>();
    b.normal = normal.cast<float>();
    b.sigma = static_cast<float>(z * sigma_d / d * std::abs(normal.dot(ray)));
    b.tilt = static_cast<float>(fx * rms / (std::sqrt(sums.suu) * slopes.norm()));
    if (!(normal.z() < 0)) b.normal.setZero();
  }
};

}  // namespace

DepthBlocks depth_blocks(const DepthFrame& frame, const DepthBlockOptions& options) {
  const CameraModel& camera = frame.camera.camera;
  const DepthNoise& noise = frame.camera.noise;
  const int side =
      std::clamp(static_cast<int>(std::lround(options.block_angle * camera.fx)), 1, 16);
  DepthBlocks result = image_of_blocks(camera, side, frame.width(), frame.height());
  const int W = result.width, H = result.height;
  result.blocks.resize(static_cast<std::size_t>(W) * static_cast<std::size_t>(H));
  if (frame.raw.size() <
      static_cast<std::size_t>(frame.width()) * static_cast<std::size_t>(frame.height())) {
    return result;
  }
  const BlockMeans means{W, H, mean_disparities(frame, options, side, W, H)};
  const NormalFit normals{options, result.fx, result.fy, noise.focal_baseline,
                          mean_sigma(noise, side)};
  for (int v = 0; v < H; ++v) {
    for (int u = 0; u < W; ++u) {
      const float d0 = means.at(u, v);
      if (d0 <= 0) continue;
      DepthBlock& b = result.blocks[static_cast<std::size_t>(v * W + u)];
      const double disparity = static_cast<double>(d0);
      const double z = noise.focal_baseline / disparity;
      const double x = (u - result.cx) / result.fx, y = (v - result.cy) / result.fy;
      b.point = Eigen::Vector3d(x * z, y * z, z).cast<float>();
      b.sigma = static_cast<float>(z * normals.sigma_d / disparity);
      normals.orient(neighbour_sums(means, u, v, options.reach), disparity, {x, y}, b);
    }
  }
  return result;
}

double median_depth(const DepthBlocks& blocks) {
  std::vector<float> z;
  for (std::size_t i = 0; i < blocks.blocks.size(); i += 7) {
    if (blocks.blocks[i].valid()) z.push_back(blocks.blocks[i].point.z());
  }
  if (z.empty()) return 1;
  std::nth_element(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(z.size() / 2), z.end());
  return static_cast<double>(z[z.size() / 2]);
}

}  // namespace lamina
