// From blocks to pixels: what is filled, and what is looked at pixel by pixel.
#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include <lamina/frontend/depth/pixel_labels.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

struct Labelled {
  DisparityImage image;
  std::vector<std::uint8_t> marks;
  int inner = 0, missed = 0;  // measured pixels three blocks from the border; those without a plane
};

// A floor alone (160 x 120), its blocks one region; pixels are labelled as if their noise were
// `believed` (px) instead of `sigma`.
Labelled label_floor(double share_missing, double sigma, double accepted, int stray = 0) {
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
  labeller.label(out.image, g, blocks, static_cast<float>(accepted), regions, out.marks);
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

// Low boxes before a wall; every piece's blocks are a region whose plane is off, so that borders
// settle from pass to pass: planes of few pixels are bent by them.
struct Pieces {
  DisparityImage image;
  DisparityGeometry g;
  BlockImage blocks;
  PlaneRegions regions;
};
void draw_pieces(double sigma, std::uint64_t seed, Pieces& out) {
  DepthCamera camera = testing::test_camera(0.7);
  camera.camera = {320, 240, 262, 262, 159.5, 119.5, {}, camera.camera.T_body_camera};
  std::vector<testing::Piece> pieces{testing::floor_piece(), testing::wall_piece(1.6)};
  for (int k = -2; k <= 2; ++k) {
    const double y = 0.3 * k, height = 0.04 * (k + 3);
    pieces.push_back(testing::square_piece(1.1, y, 0.12, height));
    pieces.push_back({Plane({-1, 0, 0}, -0.98), [=](const Eigen::Vector3d& p) {
                        return p.z() < height && std::abs(p.y() - y) < 0.12;
                      }});
  }
  const DepthFrame frame = testing::draw(pieces, camera, sigma, seed);
  fill_disparity(frame, out.image);
  out.g = DisparityGeometry::of(camera);
  fill_blocks(out.image, out.g, 8, out.blocks);
  const float s = static_cast<float>(sigma);
  remove_outliers(out.image, out.g, 5 * s, s, 20, out.blocks);
  out.regions.start(out.blocks, out.g, {sigma * sigma, sigma * sigma, 1e-4, 1e-4}, 4);
  std::vector<int> all(out.blocks.blocks.size());
  std::iota(all.begin(), all.end(), 0);
  for (const testing::Piece& piece : pieces) {
    const Plane plane_camera = camera.camera.T_body_camera.inverse() * piece.plane_body;
    out.regions.grow(all, out.g.disparity_plane(plane_camera), 100);
  }
  // As if blocks at borders had bent them: each leans by more than noise.
  double lean = 0.1 * sigma;
  for (PlaneRegion& region : out.regions.regions()) {
    region.plane += DisparityPlane(lean, -lean, sigma);
    lean = -lean;
  }
}

// Planes that are not looked at again in a block would have got none of its pixels.
TEST(PixelLabels, PlanesLeftOutOfABlockWouldHaveHadNoneOfItsPixels) {
  std::size_t planes = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const double sigma = 0.04 * static_cast<double>(seed);
    Pieces pieces;
    draw_pieces(sigma, seed, pieces);
    PlaneRegions pruned = pieces.regions, full = pieces.regions;
    planes += full.regions().size();
    std::vector<std::uint8_t> marks, all_marks;
    PixelLabeller prunes, looks(false);
    const float s = static_cast<float>(sigma);
    prunes.label(pieces.image, pieces.g, pieces.blocks, s, pruned, marks);
    looks.label(pieces.image, pieces.g, pieces.blocks, s, full, all_marks);
    EXPECT_TRUE(marks == all_marks) << seed;
    EXPECT_EQ(prunes.majority(), looks.majority()) << seed;
    for (std::size_t k = 0; k < full.regions().size(); ++k) {
      EXPECT_EQ(pruned.regions()[k].pixels, full.regions()[k].pixels) << seed;
      EXPECT_EQ(pruned.regions()[k].plane, full.regions()[k].plane) << seed;
    }
    EXPECT_LT(prunes.looks(), looks.looks()) << seed;
    EXPECT_GT(prunes.passes(), 3) << seed;
  }
  EXPECT_GE(planes, 12U);
}

}  // namespace
}  // namespace lamina
