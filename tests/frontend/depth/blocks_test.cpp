// Blocks and sums in disparity: exact on planes, blind to stray pixels.
#include <gtest/gtest.h>

#include <random>

#include <lamina/frontend/depth/blocks.hpp>
#include <lamina/frontend/depth/plane_extractor.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

using testing::draw;
using testing::floor_piece;
using testing::Piece;
using testing::test_camera;

struct Blocks {
  explicit Blocks(const DepthFrame& frame) : geometry(DisparityGeometry::of(frame.camera)) {
    fill_disparity(frame, image);
    fill_blocks(image, geometry, 8, blocks);
  }
  DisparityGeometry geometry;
  DisparityImage image;
  BlockImage blocks;
};

TEST(DisparityGeometry, PlaneAndDisparityPlaneAreInverse) {
  const DisparityGeometry g = DisparityGeometry::of(test_camera());
  const Plane plane(Eigen::Vector3d(0.1, -0.9, -0.3).normalized(), -0.8);
  const auto back = g.plane(g.disparity_plane(plane));
  ASSERT_TRUE(back);
  EXPECT_LT(angle_between(plane, *back), 1e-9);
  EXPECT_NEAR(back->rho(), -0.8, 1e-12);
  EXPECT_FALSE(g.plane({0, 0, 0}));
}

TEST(DisparitySums, MomentsAreThoseOfTheWeightedPoints) {
  const DepthCamera camera = test_camera();
  const DisparityGeometry g = DisparityGeometry::of(camera);
  const Plane plane(Eigen::Vector3d(0.05, -0.95, -0.3).normalized(), -0.8);
  const DisparityPlane p = g.disparity_plane(plane);
  const double sigma = 0.1;
  DisparitySums sums;
  Moments expected;
  for (int i = 0; i < 400; ++i) {
    const double u = -200 + 23.0 * (i % 20), v = 20 + 9.0 * (i / 20);
    const double d = p.dot(Eigen::Vector3d(u, v, 1)) + 0.05 * std::sin(i);
    sums.add(u, v, d);
    // Error of the distance to the plane per px of disparity at this pixel.
    const double per_px = std::abs(plane.rho()) / d;
    expected.add(g.point(u, v, d), 1 / std::pow(per_px * sigma, 2));
  }
  const auto moments = sums.moments(g, plane, sigma * sigma);
  ASSERT_TRUE(moments);
  EXPECT_NEAR(moments->weight() / expected.weight(), 1, 1e-9);
  EXPECT_LT((moments->mean() - expected.mean()).norm(), 1e-9);
  EXPECT_LT((moments->scatter() - expected.scatter()).norm() / expected.scatter().norm(), 1e-9);
  // The cost is the chi-squared of the disparities, for any plane near.
  EXPECT_NEAR(moments->cost(plane) / (sums.sse(p) / (sigma * sigma)), 1, 1e-6);
}

TEST(Blocks, EveryBlockOfAFloorLiesOnIt) {
  const DepthFrame frame = draw({floor_piece()}, test_camera());
  const Blocks b(frame);
  const Plane floor_camera = frame.camera.camera.T_body_camera.inverse() * Plane();
  const Eigen::Vector3f p = b.geometry.disparity_plane(floor_camera).cast<float>();
  int full = 0;
  for (const Block& block : b.blocks.blocks) {
    if (block.n < 64) continue;
    ++full;
    EXPECT_LT(std::abs(block.residual(p)), 0.02F);
    EXPECT_LT(block.mean_square(p, block.residual(p)), 1e-3F);
  }
  EXPECT_GT(full, 3000);
}

TEST(Blocks, SumsOfBlocksAreSumsOfPixels) {
  DepthFrame frame = draw({floor_piece()}, test_camera(), 0.1);
  for (std::size_t i = 0; i < frame.raw.size(); i += 7) frame.raw[i] = 0;  // holes: the slow path
  for (std::size_t i = 640 * 400; i < frame.raw.size(); ++i) {
    if (frame.raw[i] == 0) frame.raw[i] = frame.raw[i - 1];
  }
  const Blocks b(frame);
  DisparitySums blocks, pixels;
  for (const Block& block : b.blocks.blocks) {
    if (block.n > 0) blocks += block.sums();
  }
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const double d = static_cast<double>(b.image.row(v)[u]);
      if (d > 0) pixels.add(u - 319.5, v - 239.5, d);
    }
  }
  EXPECT_EQ(blocks.n, pixels.n);
  EXPECT_NEAR(blocks.ud / pixels.ud, 1, 1e-4);
  EXPECT_NEAR(blocks.vd / pixels.vd, 1, 1e-4);
  EXPECT_NEAR(blocks.dd / pixels.dd, 1, 1e-4);
  EXPECT_LT((*blocks.fit() - *pixels.fit()).norm(), 1e-3);
}

TEST(Outliers, AStrayPixelIsTakenOutAndItsBlockHeals) {
  DepthFrame frame = draw({floor_piece()}, test_camera());
  frame.raw[static_cast<std::size_t>(400 * 640 + 300)] = 9000;
  Blocks b(frame);
  remove_outliers(b.image, b.geometry, 0.2F, 0.056F, 32, b.blocks);
  EXPECT_TRUE(is_outlier(b.image, 300, 400, 0.2F));
  EXPECT_FALSE(is_outlier(b.image, 310, 400, 0.2F));
  const Block& block = b.blocks.at(300 / 8, 400 / 8);
  EXPECT_TRUE(block.flat);
  EXPECT_EQ(block.n, 63);
}

// remove_outliers() tests four pixels at once, is_outlier() one: healed blocks hold the same.
TEST(Outliers, HealedBlocksHoldWhatIsNoOutlier) {
  DepthFrame frame = draw({floor_piece()}, test_camera(), 0.05);
  for (std::size_t i = 0; i < frame.raw.size(); i += 131) frame.raw[i] = i % 3 == 0 ? 0 : 9000;
  Blocks b(frame);
  const std::vector<Block> before = b.blocks.blocks;
  remove_outliers(b.image, b.geometry, 0.2F, 0.056F, 32, b.blocks);
  int healed = 0;
  for (int i = 0; i < 80 * 60; ++i) {
    const Block& block = b.blocks.blocks[static_cast<std::size_t>(i)];
    if (block.n == before[static_cast<std::size_t>(i)].n) continue;
    int kept = 0;
    for (int v = i / 80 * 8; v < i / 80 * 8 + 8; ++v) {
      for (int u = i % 80 * 8; u < i % 80 * 8 + 8; ++u) {
        kept += b.image.row(v)[u] > 0 && !is_outlier(b.image, u, v, 0.2F);
      }
    }
    EXPECT_EQ(block.n, kept);
    ++healed;
  }
  EXPECT_GT(healed, 500);
}

// A camera 0.3 m above the floor sees a quarter of a pixel of disparity a row: pixels that look
// half a pixel aside read off by an eighth, twice the noise of their disparities.
TEST(Outliers, SteepBlocksStayFlatThoughTheirPixelsLookAside) {
  DepthFrame frame = draw({floor_piece()}, test_camera());
  DisparityImage image;
  fill_disparity(frame, image);
  std::uint64_t state = 7;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      const float aside = (static_cast<float>(state >> 40) / 16777216.0F - 0.5F) * 1.7320508F;
      image.d[static_cast<std::size_t>(v * image.width + u)] =
          20 + 0.25F * (static_cast<float>(v) + aside);
    }
  }
  const auto flat_blocks = [&](float sigma) {
    Blocks b(frame);
    fill_blocks(image, b.geometry, 8, b.blocks);
    remove_outliers(image, b.geometry, 0.25F, sigma, 32, b.blocks);
    int flat = 0;
    for (const Block& block : b.blocks.blocks) flat += block.flat;
    return flat;
  };
  const int all = 80 * 60;
  EXPECT_GT(flat_blocks(0.056F), all * 99 / 100);
  // Jitter is allowed for up to a few sigmas only: a much better sensor sees these rows as rough.
  EXPECT_LT(flat_blocks(0.02F), all / 2);
}

TEST(Outliers, DepthEdgesAreNotOutliers) {
  const DepthFrame frame =
      draw({floor_piece(), testing::square_piece(2, 0, 0.3, 0.3)}, test_camera());
  const Blocks b(frame);
  int outliers = 0, seen = 0;
  for (int v = 1; v < 479; ++v) {
    for (int u = 1; u < 639; ++u) {
      if (!(b.image.row(v)[u] > 0)) continue;
      ++seen;
      outliers += is_outlier(b.image, u, v, 0.2F);
    }
  }
  EXPECT_LT(outliers, seen / 500);
}

TEST(Noise, ScaleFollowsANoisierSensor) {
  const DepthCamera camera = test_camera();
  const double sigma = camera.noise.disparity_sigma;
  const Blocks quiet(draw({floor_piece()}, camera, sigma)),
      loud(draw({floor_piece()}, camera, 3 * sigma));
  EXPECT_NEAR(noise_scale(quiet.blocks, sigma), 1, 0.1);
  EXPECT_NEAR(noise_scale(loud.blocks, sigma), 3, 0.4);
}

// The fewer pixels, the steeper a near floor from one to the next: what half a pixel of jitter may
// make there hides any noise. Walls tell it.
TEST(Noise, ScaleOfACoarseCameraIsThatOfWalls) {
  DepthCamera camera = testing::small_test_camera(0.35);
  SE3& T_body_camera = camera.camera.T_body_camera;
  T_body_camera = SE3(T_body_camera.so3(), {0, 0, 0.5});
  camera.noise = DepthNoise::kinect(131);
  const double sigma = camera.noise.disparity_sigma;
  const Piece wall{Plane({-1, 0, 0}, -2.5), [](const Eigen::Vector3d& p) { return p.z() > 0; }};
  for (const double factor : {1.0, 2.8}) {
    const Blocks seen(draw({floor_piece(), wall}, camera, factor * sigma));
    EXPECT_NEAR(noise_scale(seen.blocks, sigma), factor, 0.12 * factor);
  }
}

// A real camera that is said to be ideal is up to twenty times as noisy.
TEST(Noise, ARealCameraMayBeSaidToBeIdeal) {
  DepthCamera camera = test_camera();
  const double sigma = camera.noise.disparity_sigma;
  const Blocks real(draw({floor_piece()}, camera, sigma));
  EXPECT_NEAR(noise_scale(real.blocks, sigma / 10, 20), 10, 1);
  EXPECT_NEAR(noise_scale(real.blocks, sigma / 10), 4, 1e-6);
  camera.noise = DepthNoise::ideal(camera.camera.fx);
  const DepthFrame frame = draw({floor_piece()}, camera, 10 * camera.noise.disparity_sigma);
  PlaneExtractor extractor{FloorOptions()};
  extractor.extract(frame, MountingPrior());
  EXPECT_GT(extractor.noise_scale(), 7);
}

// A third of the pixels missing everywhere leaves no block nine tenths full: those that are half
// full tell the noise as well.
TEST(Noise, ScaleIsMeasuredInImagesFullOfHoles) {
  const DepthCamera camera = testing::small_test_camera(0.445);
  const double sigma = camera.noise.disparity_sigma;
  for (const double factor : {1.0, 3.0}) {
    const DepthFrame whole = draw({floor_piece()}, camera, factor * sigma);
    const double expected = noise_scale(Blocks(whole).blocks, sigma);
    for (const double share : {0.15, 0.22, 0.33}) {
      DepthFrame frame = whole;
      std::mt19937 random(7);
      for (auto& raw : frame.raw) {
        if (static_cast<double>(random()) < share * 4294967296.0) raw = 0;
      }
      EXPECT_NEAR(noise_scale(Blocks(frame).blocks, sigma), expected, 0.07 * factor) << share;
    }
  }
}

// Blocks with holes that lie at edges do not count beside full ones.
TEST(Noise, HolesAtEdgesDoNotCountBesideFullBlocks) {
  const DepthCamera camera = test_camera();
  const double sigma = camera.noise.disparity_sigma;
  const Blocks full(draw({floor_piece()}, camera, sigma));
  BlockImage some = full.blocks;
  std::size_t holed = 0;
  for (std::size_t i = 0; i < some.blocks.size() && 5 * holed < 4 * some.blocks.size(); ++i) {
    Block& block = some.blocks[i];
    if (!(block.n == 64) || i % 6 == 0) continue;
    block.n = 40;
    block.sse *= 100;
    ++holed;
  }
  EXPECT_GT(holed, some.blocks.size() / 3);
  EXPECT_NEAR(noise_scale(some, sigma), 1, 0.15);
}

// A room's corner over a cupboard's: at a quarter of the pixels most places twelve blocks apart lie
// on different planes. That is structure, not the sensor's slow distortion.
TEST(Noise, ACornerSeenSmallIsNotTakenForDistortion) {
  DepthCamera camera = test_camera(0.445, 1.535);
  const SE3 T_body_camera = camera.camera.T_body_camera;
  camera.camera = {320, 240, 267.5, 267.5, 159.5, 119.5, {}, T_body_camera};
  camera.noise = DepthNoise::kinect(267.5);
  const SE3 T_room_body(SO3::rot_z(0.536), {1.44, 1.53, 0});
  std::vector<Piece> pieces;
  const auto add = [&](const Eigen::Vector3d& n, double offset, const Eigen::AlignedBox3d& room) {
    const Plane plane(T_room_body.so3().inverse() * n, offset - n.dot(T_room_body.translation()));
    pieces.push_back(
        {plane, [=](const Eigen::Vector3d& p) { return room.contains(T_room_body * p); }});
  };
  const Eigen::AlignedBox3d all(Eigen::Vector3d(-9, -9, -9), Eigen::Vector3d(9, 9, 9));
  const auto add_box = [&](const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const Eigen::Vector3d rim = Eigen::Vector3d::Constant(1e-6);
    const Eigen::AlignedBox3d box(low - rim, high + rim);
    add({0, 0, 1}, high.z(), box);
    add({-1, 0, 0}, -low.x(), box);
    add({0, -1, 0}, -low.y(), box);
  };
  add({0, 0, 1}, 0, all);
  add({-1, 0, 0}, -6, all);
  add({0, -1, 0}, -5, all);
  add_box({2.5, 2.2, 0}, {3.5, 2.8, 0.7});
  add_box({4.8, 4.0, 0}, {5.6, 4.6, 0.5});
  const double sigma = camera.noise.disparity_sigma;
  Blocks b(draw(pieces, camera, sigma));
  remove_outliers(b.image, b.geometry, static_cast<float>(5 * sigma), static_cast<float>(sigma), 32,
                  b.blocks);
  const double model = std::pow(camera.noise.disparity_floor, 2);
  EXPECT_LT(std::sqrt(shared_variance(b.blocks, sigma * sigma / 64, model)), 0.03);
}

// What is left of a block without its outliers, by a plain loop: pixels, and squared residuals from
// its own plane.
DisparitySums kept_of(const DisparityImage& image, int c, int r, float tolerance) {
  DisparitySums sums;
  for (int v = 8 * r; v < 8 * r + 8; ++v) {
    for (int u = 8 * c; u < 8 * c + 8; ++u) {
      const auto d = static_cast<double>(image.row(v)[u]);
      if (d > 0 && !is_outlier(image, u, v, tolerance)) sums.add(u - 8 * c, v - 8 * r, d);
    }
  }
  return sums;
}

// Blocks that outliers alone made uneven are healed, those with an edge are not: as a plain loop
// says, but for those at the limit.
TEST(Outliers, BlocksHealAsAPlainLoopSays) {
  constexpr float kSigma = 0.1F, kTolerance = 0.5F, kLeast = 20;
  std::mt19937 random(11);
  std::normal_distribution<float> noise(0, kSigma);
  DisparityImage image{240, 160, std::vector<float>(240 * 160)};
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      // Stripes of edges from hardly any to large ones, stray and missing pixels.
      const float edge = (u / 12) % 2 == 0 ? 0 : 0.02F * static_cast<float>(v);
      float& d = image.d[static_cast<std::size_t>(v * image.width + u)];
      d = 20 + 0.05F * static_cast<float>(u) + edge + noise(random);
      if (random() % 60 == 0) d += 5;
      if (random() % 20 == 0) d = 0;
    }
  }
  const DisparityGeometry g{500, 500, 120, 80, 40};
  BlockImage blocks;
  fill_blocks(image, g, 8, blocks);
  remove_outliers(image, g, kTolerance, kSigma, kLeast, blocks);
  int flat = 0, uneven = 0;
  for (int r = 0; r < blocks.rows; ++r) {
    for (int c = 0; c < blocks.columns; ++c) {
      const DisparitySums sums = kept_of(image, c, r, kTolerance);
      const auto plane = sums.fit();
      ASSERT_TRUE(plane);
      const double limit =
          1.8 * 1.8 *
          (static_cast<double>(kSigma * kSigma) + 0.25 * plane->head<2>().squaredNorm()) *
          (sums.n - 3);
      const double sse = sums.sse(*plane);
      flat += sse < 0.99 * limit;
      uneven += sse > 1.01 * limit;
      // A block flat with its stray pixels keeps them.
      if (sse < 0.99 * limit) {
        EXPECT_TRUE(blocks.at(c, r).flat) << c << ' ' << r;
      }
      if (sse > 1.6 * limit) {
        EXPECT_FALSE(blocks.at(c, r).flat) << c << ' ' << r;
      }
    }
  }
  EXPECT_GT(flat, 100);
  EXPECT_GT(uneven, 100);
}

}  // namespace
}  // namespace lamina
