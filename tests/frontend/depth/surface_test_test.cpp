// Pixels' planes: creases, parts of one plane, and posts that are none.
#include <gtest/gtest.h>

#include <random>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/depth/surface_test.hpp>

#include "frontend/depth/depth_scene.hpp"

namespace lamina {
namespace {

using testing::draw;
using testing::floor_piece;
using testing::Piece;
using testing::test_camera;

Piece upright(double x, const std::function<bool(const Eigen::Vector3d&)>& inside) {
  return {Plane({-1, 0, 0}, -x), inside};
}

Piece level(double z, double x0, double x1, double y0, double y1) {
  return {Plane({0, 0, 1}, z), [=](const Eigen::Vector3d& p) {
            return p.x() > x0 && p.x() < x1 && p.y() > y0 && p.y() < y1;
          }};
}

// Pixels whose plane is that of the pixel at (u, v).
std::int64_t pixels_of(const FloorResult& r, int u, int v) {
  const int k = r.plane_at(u, v, 640);
  return k < 0 ? 0 : r.planes[static_cast<std::size_t>(k)].pixels;
}

TEST(PixelBorders, ALowFaceKeepsItsSlopeAndItsPixels) {
  // The face of a 6 cm step, 2 m ahead: 15 rows, two blocks of eight at most, none of them pure.
  const double sigma = DepthNoise::kinect(525).disparity_sigma;
  const DepthFrame frame = draw(
      {floor_piece(), level(0.06, 2, 3, -0.8, 0.8),
       upright(2, [](const Eigen::Vector3d& p) { return p.z() < 0.06 && std::abs(p.y()) < 0.8; })},
      test_camera(), sigma);
  FloorFrontend frontend;
  const FloorResult r = frontend.process(frame);
  double best = 0;
  for (const ExtractedPlane& p : r.planes) {
    if (p.slope > 1.36 && p.slope < 1.78) best = std::max(best, static_cast<double>(p.pixels));
  }
  // 0.06 m x 1.6 m, 2 m ahead; bent by its foot it would lean by half a right angle.
  const double expected = 1.6 * 525 / 2.0 * 0.06 * 525 / 2.0;
  EXPECT_GT(best, 0.65 * expected);
  EXPECT_LT(best, 1.2 * expected);
}

TEST(PlaneParts, TwoPlatformsAreNotOneTiltedPlane) {
  const double sigma = DepthNoise::kinect(525).disparity_sigma;
  const DepthFrame frame =
      draw({floor_piece(), level(0.02, 1.6, 2.6, 0.3, 1.3), level(0.03, 1.6, 2.6, -1.3, -0.3)},
           test_camera(), sigma);
  FloorFrontend frontend;
  const FloorResult r = frontend.process(frame);
  int platforms = 0;
  for (const ExtractedPlane& p : r.planes) {
    platforms += p.pixels > 3000 && p.height > 0.012 && p.height < 0.04;
  }
  EXPECT_EQ(platforms, 2);
}

// Noise of a stereo camera: no two sigmas between the platforms in one image.
TEST(PlaneParts, TwoPlatformsOnAFloorStayTwoHoweverNoisyTheImage) {
  DepthCamera camera = test_camera();
  camera.noise.disparity_floor *= 4;
  const double sigma = DepthNoise::kinect(525).disparity_sigma;
  FloorFrontend frontend;
  const FloorResult r = frontend.process(
      draw({floor_piece(), level(0.04, 1.6, 2.6, 0.3, 1.3), level(0.043, 1.6, 2.6, -1.3, -0.3)},
           camera, sigma));
  int platforms = 0;
  for (const ExtractedPlane& p : r.planes) {
    platforms += p.pixels > 3000 && p.height > 0.03 && p.height < 0.055;
  }
  EXPECT_EQ(platforms, 2);
}

TEST(PlaneParts, AFloorBeyondAPitIsTheFloor) {
  const double sigma = DepthNoise::kinect(525).disparity_sigma;
  FloorFrontend frontend;
  const FloorResult r = frontend.process(
      draw({level(0, 0, 1.6, -5, 5), level(0, 2.2, 9, -5, 5), level(-0.3, 0, 9, -5, 5)},
           test_camera(), sigma));
  EXPECT_GE(r.plane_at(320, 440, 640), 0);
  EXPECT_EQ(r.plane_at(320, 440, 640), r.plane_at(320, 150, 640));
}

// Blocks that hold the end of a platform and the floor behind it.
TEST(PlaneEdges, TheFarEdgeOfAPlatformIsNoRamp) {
  const double sigma = DepthNoise::kinect(525).disparity_sigma;
  for (const std::uint64_t seed : {1u, 2u}) {
    FloorFrontend frontend;
    const FloorResult r = frontend.process(
        draw({floor_piece(), level(0.02, 1.6, 2.6, -0.6, 0.6)}, test_camera(), sigma, seed));
    for (const ExtractedPlane& p : r.planes) {
      EXPECT_FALSE(p.slope > 0.05 && p.slope < 0.5) << p.pixels << " pixels of slope " << p.slope;
    }
  }
}

TEST(PlaneParts, AWallSeenBetweenPostsIsOne) {
  const double sigma = DepthNoise::kinect(525).disparity_sigma;
  std::vector<Piece> pieces{floor_piece(), upright(4, [](const Eigen::Vector3d&) { return true; })};
  for (const double y : {-0.6, 0.0, 0.6}) {
    pieces.push_back(
        upright(2, [y](const Eigen::Vector3d& p) { return std::abs(p.y() - y) < 0.1; }));
  }
  FloorFrontend frontend;
  const FloorResult r = frontend.process(draw(pieces, test_camera(0.1), sigma));
  int walls = 0;
  for (const ExtractedPlane& p : r.planes) walls += std::abs(p.centroid_camera.z() - 4) < 0.4;
  EXPECT_EQ(walls, 1);
  EXPECT_GT(pixels_of(r, 260, 100), 40000);
}

TEST(PlaneEvidence, StripsInTheOpenAreNoSurface) {
  RegionEvidence wall, posts, bent, face;
  wall.across = {10, 9, 3000};
  wall.down = {30, 0, 3000};
  EXPECT_TRUE(is_surface(wall, 3.0)) << "large ones are never doubted";
  posts.across = {40, 35, 240};
  posts.down = {4, 0, 240};
  EXPECT_FALSE(is_surface(posts, 1.0));
  bent.across = {20, 15, 400};
  bent.down = {10, 0, 400};
  EXPECT_TRUE(is_surface(bent, 1.0));
  EXPECT_FALSE(is_surface(bent, 1.3)) << "a rail is round";
  face.across = {4, 0, 800};
  face.down = {80, 0, 800};
  EXPECT_TRUE(is_surface(face, 1.1));
  EXPECT_FALSE(is_surface(face, 2.0)) << "holds two surfaces";
}

TEST(PlaneEvidence, ARowOfPostsBecomesNoPlane) {
  const double sigma = DepthNoise::kinect(525).disparity_sigma;
  std::vector<Piece> pieces{floor_piece()};
  for (int i = -8; i <= 8; ++i) {
    const double y = 0.12 * i;
    pieces.push_back(upright(
        2, [y](const Eigen::Vector3d& p) { return std::abs(p.y() - y) < 0.01 && p.z() < 1.2; }));
  }
  FloorFrontend frontend;
  const FloorResult r = frontend.process(draw(pieces, test_camera(0.2), sigma));
  for (const ExtractedPlane& p : r.planes) {
    EXPECT_FALSE(p.slope > 1.2 && std::abs(p.centroid_camera.z() - 2) < 0.3) << p.pixels;
  }
}

// Of a wall of 20 px of disparity, its pixels labelled 1.
RegionEvidence of_a_wall(const DisparityImage& image, const std::vector<std::uint8_t>& labels) {
  PlaneRegion wall;
  wall.plane = {0, 0, 20};
  const DisparityGeometry g = DisparityGeometry::of(test_camera());
  return gather_evidence(image, g, labels, {wall}, 8, 1).at(0);
}

// What was not measured ends no run of a surface: with a third of its pixels lost it is no strips.
TEST(PlaneEvidence, MissingPixelsEndNoRun) {
  DisparityImage image{160, 64, std::vector<float>(160 * 64, 20)};
  std::vector<std::uint8_t> labels(160 * 64, 1);
  std::minstd_rand random(1);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (random() % 3 == 0) image.d[i] = labels[i] = 0;
  }
  const RegionEvidence evidence = of_a_wall(image, labels);
  EXPECT_GT(evidence.across.length(), 120);
  EXPECT_TRUE(is_surface(evidence, 2.0));
}

// Posts 16 px apart before nothing: what lies between them is missing, and no part of them.
TEST(PlaneEvidence, PostsBeforeNothingDoNotJoin) {
  DisparityImage image{160, 64, std::vector<float>(160 * 64, 0)};
  std::vector<std::uint8_t> labels(160 * 64, 0);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (i % 160 % 16 >= 4) continue;
    image.d[i] = 20;
    labels[i] = 1;
  }
  EXPECT_EQ(of_a_wall(image, labels).across.length(), 4);
}

// Other resolutions and optics: the floor and the wall are found just the same.
TEST(FloorFrontend, WorksAtOtherResolutionsAndTilts) {
  struct Case {
    int width, height;
    double focal, pitch;
  };
  for (const Case& c :
       {Case{320, 240, 262, 0.45}, Case{848, 480, 430, 0.45}, Case{1280, 720, 640, 0.45},
        Case{640, 480, 525, 1.1}, Case{640, 480, 525, 0.12}}) {
    DepthCamera camera = test_camera(c.pitch);
    camera.camera.width = c.width;
    camera.camera.height = c.height;
    camera.camera.fx = camera.camera.fy = c.focal;
    camera.camera.cx = 0.5 * (c.width - 1);
    camera.camera.cy = 0.5 * (c.height - 1);
    camera.noise = DepthNoise::kinect(c.focal);
    FloorFrontend frontend;
    const FloorResult r =
        frontend.process(draw({floor_piece()}, camera, camera.noise.disparity_sigma));
    ASSERT_EQ(r.status, FloorStatus::kFound) << c.width << " pitch " << c.pitch << ": " << r.reason;
    EXPECT_NEAR(-r.floor_camera->rho(), 0.8, 0.004) << c.width << " pitch " << c.pitch;
    EXPECT_EQ(r.low_obstacles.size(), 0u) << c.width << " pitch " << c.pitch;
  }
}

}  // namespace
}  // namespace lamina
