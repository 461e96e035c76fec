// One pass over a depth image: disparity, and the sums and plane of every pixel block.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <lamina/frontend/depth/disparity_sums.hpp>
#include <lamina/sensors/depth_frame.hpp>

namespace lamina {

/// Disparity in pixels, row-major; 0 where there is no measurement or it is out of range.
struct DisparityImage {
  int width = 0, height = 0;
  std::vector<float> d;
  const float* row(int v) const {
    return d.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
  }
};

/// Fills `image` from the frame; keeps its memory. Depth outside the noise model's range and
/// saturated values (65535) are no measurements. A frame whose raw data is shorter than
/// width * height, or whose geometry is senseless, gives an image without measurements.
void fill_disparity(const DepthFrame& frame, DisparityImage& image);

/// Sensors look up to half a pixel beside a pixel [Barron2013]: on a plane of slope (a, b) that
/// adds this much variance (px^2) to every pixel of its own.
inline float jitter_variance(float a, float b) { return 0.25F * (a * a + b * b); }

/// A block: count, means, its own plane and what is left over. (u, v) from the principal point.
struct Block {
  float n = 0;                      ///< pixels
  float u = 0, v = 0, d = 0;        ///< means
  float cuu = 0, cuv = 0, cvv = 0;  ///< centred sums of the pixel positions
  float a = 0, b = 0;               ///< slopes of its own plane
  float sse = 0;                    ///< sum of squared residuals from its own plane (px^2)
  bool flat = false;                ///< its pixels agree with one plane within their noise

  DisparitySums sums() const;
  /// Residual of the block's mean from a plane (px).
  float residual(const Eigen::Vector3f& p) const { return d - (p.x() * u + p.y() * v + p.z()); }
  /// What a plane's other slope adds to the sum of squared residuals (px^2).
  float tilt(const Eigen::Vector3f& p) const {
    const float da = a - p.x(), db = b - p.y();
    return da * da * cuu + 2 * da * db * cuv + db * db * cvv;
  }
  /// Mean squared residual of its pixels from a plane (px^2), given the mean residual.
  float mean_square(const Eigen::Vector3f& p, float mean_residual) const {
    return (sse + tilt(p)) / n + mean_residual * mean_residual;
  }
};

// Here to be inlined: the plane stage asks for them some twenty thousand times a frame.
inline DisparitySums Block::sums() const {
  DisparitySums s;
  const double N = n, U = u, V = v, D = d;
  // Centred sums of (u, d) and (v, d) follow from the block's own plane.
  const double cud = static_cast<double>(a) * cuu + static_cast<double>(b) * cuv;
  const double cvd = static_cast<double>(a) * cuv + static_cast<double>(b) * cvv;
  s.n = N;
  s.u = N * U;
  s.v = N * V;
  s.d = N * D;
  s.uu = cuu + N * U * U;
  s.uv = cuv + N * U * V;
  s.vv = cvv + N * V * V;
  s.ud = cud + N * U * D;
  s.vd = cvd + N * V * D;
  s.dd = sse + static_cast<double>(a) * cud + static_cast<double>(b) * cvd + N * D * D;
  return s;
}

struct BlockImage {
  int size = 8, columns = 0, rows = 0;
  std::vector<Block> blocks;
  int index(int c, int r) const { return r * columns + c; }
  const Block& at(int c, int r) const { return blocks[static_cast<std::size_t>(index(c, r))]; }
};

/// Sums of every block, all in one pass; blocks at the right and lower border may be smaller.
void fill_blocks(const DisparityImage& image, const DisparityGeometry& g, int size,
                 BlockImage& blocks);

/// How much noisier the frame is than its model says: from the quieter blocks' residuals, less the
/// jitter of slopes; where some have so little slope that this is less than the noise, from these.
/// Full blocks count, and half-full ones where hardly any is full. Never below 1
/// (neighbours are alike, so blocks understate noise) nor above `most`.
double noise_scale(const BlockImage& blocks, double disparity_sigma, double most = 4);

/// Variance (px^2) of what whole patches share, as the frame shows it: second differences of block
/// means that far apart (three fortieths of the image's width) vanish on planes, whatever their
/// slope; what the quieter ones leave beyond `variance_of_mean` is the sensor's slow distortion.
/// Never below `model`, at most (0.15 px)^2, less in images of less than 640 columns.
double shared_variance(const BlockImage& blocks, double variance_of_mean, double model);

/// The local outlier test. A pixel is an outlier when its distance (in disparity) to what its
/// neighbours say, along the row and along the column, is beyond `tolerance` both ways: the
/// document's mean distance to neighbours against the noise bounds, on an organised image, where
/// slopes cancel and depth edges do not. Pixels with no pair of neighbours are outliers.
bool is_outlier(const DisparityImage& image, int u, int v, float tolerance);

/// Takes outliers out of the blocks that are not flat with them, and marks which blocks are flat:
/// at least `min_pixels`, and rms below 1.8 `sigma` (px, of one pixel), the jitter of a slope
/// added.
void remove_outliers(const DisparityImage& image, const DisparityGeometry& g, float tolerance,
                     float sigma, float min_pixels, BlockImage& blocks);

}  // namespace lamina
