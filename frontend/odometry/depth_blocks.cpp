// Means and planes of pixel blocks, in disparity.
#include <lamina/frontend/odometry/depth_blocks.hpp>

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

}  // namespace

DepthBlocks depth_blocks(const DepthFrame& frame, const DepthBlockOptions& options) {
  const CameraModel& camera = frame.camera.camera;
  const DepthNoise& noise = frame.camera.noise;
  DepthBlocks result;
  const int side =
      std::clamp(static_cast<int>(std::lround(options.block_angle * camera.fx)), 1, 16);
  result.width = frame.width() / side;
  result.height = frame.height() / side;
  const double n = side, middle = 0.5 * (n - 1);
  result.fx = camera.fx / n;
  result.fy = camera.fy / n;
  result.cx = (camera.cx - middle) / n;
  result.cy = (camera.cy - middle) / n;
  const int W = result.width, H = result.height;
  result.blocks.resize(static_cast<std::size_t>(W) * static_cast<std::size_t>(H));
  if (frame.raw.size() <
      static_cast<std::size_t>(frame.width()) * static_cast<std::size_t>(frame.height())) {
    return result;
  }
  const std::vector<float> mean = mean_disparities(frame, options, side, W, H);
  const double samples = std::max(1.0, n * n / noise.pixels_per_sample());
  const double sigma_d = std::sqrt(noise.disparity_sigma * noise.disparity_sigma / samples +
                                   noise.disparity_step * noise.disparity_step / 12);
  const int reach = options.reach;
  for (int v = 0; v < H; ++v) {
    for (int u = 0; u < W; ++u) {
      const std::size_t at = static_cast<std::size_t>(v * W + u);
      const float d0 = mean[at];
      if (d0 <= 0) continue;
      DepthBlock& b = result.blocks[at];
      const double z = noise.focal_baseline / static_cast<double>(d0);
      const double x = (u - result.cx) / result.fx, y = (v - result.cy) / result.fy;
      b.point = Eigen::Vector3d(x * z, y * z, z).cast<float>();
      b.sigma = static_cast<float>(z * sigma_d / static_cast<double>(d0));
      // d - d0 = a du + b dv + c over the neighbours: normal equations of three unknowns.
      double suu = 0, suv = 0, svv = 0, su = 0, sv = 0, sd = 0, sud = 0, svd = 0, sdd = 0;
      int count = 0;
      const float near = 0.1F * d0;
      for (int j = std::max(0, v - reach); j <= std::min(H - 1, v + reach); ++j) {
        for (int i = std::max(0, u - reach); i <= std::min(W - 1, u + reach); ++i) {
          const float d1 = mean[static_cast<std::size_t>(j * W + i)];
          if (d1 <= 0 || std::abs(d1 - d0) > near) continue;
          const double du = i - u, dv = j - v, dd = static_cast<double>(d1 - d0);
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
      }
      if (count < (2 * reach + 1) * (2 * reach + 1) * 2 / 3) continue;
      Eigen::Matrix3d A;
      A << suu, suv, su, suv, svv, sv, su, sv, count;
      const Eigen::Vector3d rhs(sud, svd, sd);
      const Eigen::Vector3d fit = A.inverse() * rhs;
      const double rms = std::sqrt(std::max(0.0, sdd - fit.dot(rhs)) / (count - 3));
      if (!(rms < options.flat_sigmas * sigma_d + 0.002 * static_cast<double>(d0))) continue;
      // The fitted disparity is better than the block's own.
      const double d = static_cast<double>(d0) + fit.z();
      const double a = fit.x() * result.fx, c = fit.y() * result.fy;
      const Eigen::Vector3d slopes(a, c, d - a * x - c * y);
      const Eigen::Vector3d normal = -slopes.normalized();
      const double zf = noise.focal_baseline / d;
      b.point = Eigen::Vector3d(x * zf, y * zf, zf).cast<float>();
      b.normal = normal.cast<float>();
      b.sigma =
          static_cast<float>(zf * sigma_d / d * std::abs(normal.dot(Eigen::Vector3d(x, y, 1))));
      b.tilt = static_cast<float>(result.fx * rms / (std::sqrt(suu) * slopes.norm()));
      if (!(normal.z() < 0)) b.normal.setZero();
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
