// From blocks to pixels: what is filled, and what is looked at pixel by pixel.
#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include <lamina/frontend/floor/pixel_labels.hpp>

#include "depth_scene.hpp"

namespace lamina {
namespace {

struct Labelled {
  DisparityImage image;
  std::vector<std::uint8_t> marks;
  int inner = 0, missed = 0;  // measured pixels three blocks from the border; those without a plane
};

// A floor alone (160 x 120), its blocks one region; pixels are labelled as if their noise were
// `believed` (px) instead of `sigma`.
Labelled label_floor(double share_missing, double sigma, double believed, int stray = 0) {
  const DepthCamera camera = testing::small_test_camera(1.5);
  DepthFrame frame = testing::draw({testing::floor_piece()}, camera, sigma);
  std::mt19937 random(3);
  for (auto& raw : frame.raw) {
    if (static_cast<double>(random()) < share_missing * 4294967296.0) raw = 0;
  }
  if (stray > 0) frame.raw[60 * 160 + 80] = static_cast<std::uint16_t>(stray);
  Labelled out;
  fill_disparity(frame, out.image);
  const DisparityGeometry g = DisparityGeometry::of(camera);
  BlockImage blocks;
  fill_blocks(out.image, g, 8, blocks);
  const float s = static_cast<float>(sigma);
  remove_outliers(out.image, g, 5 * s, s, 20, blocks);
  PlaneRegions regions;
  regions.start(blocks, g, {sigma * sigma, sigma * sigma, 1e-4, 1e-4}, 4);
  std::vector<int> seeds(blocks.blocks.size());
  std::iota(seeds.begin(), seeds.end(), 0);
  const Plane floor = camera.camera.T_body_camera.inverse() * Plane({0, 0, 1}, 0);
  regions.grow(seeds, g.disparity_plane(floor), 100);
  PixelLabeller labeller;
  labeller.label(out.image, g, blocks, static_cast<float>(believed), regions, out.marks);
  for (int v = 24; v < 96; ++v) {
    for (int u = 24; u < 136; ++u) {
      if (!(out.image.row(v)[u] > 0)) continue;
      ++out.inner;
      out.missed += out.marks[static_cast<std::size_t>(v * 160 + u)] == 0;
    }
  }
  return out;
}

// Noise alike over a block is underrated by the block itself. What lies amid a plane is its own
// nevertheless, whether pixels are missing or not: it would become obstacles before a wall.
TEST(PixelLabels, PixelsAmidAPlaneAreItsOwnWherePixelsAreMissing) {
  const double sigma = testing::small_test_camera(1.5).noise.disparity_sigma;
  for (const double share : {0.0, 0.1, 0.3}) {
    const Labelled l = label_floor(share, sigma, sigma / 3);
    EXPECT_GT(l.inner, 5000) << share;
    EXPECT_LT(l.missed, l.inner / 200) << share;
  }
}

TEST(PixelLabels, MissingPixelsBelongToNothing) {
  const Labelled l = label_floor(0.3, 0.1, 0.1);
  for (std::size_t i = 0; i < l.marks.size(); ++i) {
    if (l.image.d[i] > 0) continue;
    ASSERT_EQ(l.marks[i], 0) << i;
  }
}

// A block with an outlier is looked at pixel by pixel, as before.
TEST(PixelLabels, AStrayPixelAmidAPlaneIsNotItsOwn) {
  const Labelled l = label_floor(0.3, 0.05, 0.05, 2000);  // at 0.4 m, the floor at 0.8 m
  EXPECT_EQ(l.marks[60 * 160 + 80], 0);
}

}  // namespace
}  // namespace lamina
