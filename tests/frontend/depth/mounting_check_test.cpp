// Floors and walls of a robot in a box room, seen by a camera whose calibration is wrong.
#include <gtest/gtest.h>

#include <cmath>

#include <lamina/frontend/depth/mounting_check.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

// 0.8 m high, 20 degrees down.
SE3 mounting(double height = 0.8, double pitch_deg = 20) {
  return SE3(SO3::rot_y(pitch_deg * kDegree) * forward_looking_camera().so3(), {0.1, 0, height});
}

// The plane as a camera has it whose 1 / depth is too large by `offset` (1/m).
Plane with_offset(const Plane& plane_camera, double offset) {
  const Eigen::Vector3d n = plane_camera.normal();
  return Plane(n + Eigen::Vector3d(0, 0, offset * plane_camera.rho()), plane_camera.rho());
}

// The plane as a camera has it whose calibrated points X are at M X in truth: n . M X = rho.
Plane as_stated(const Plane& plane_camera, const Eigen::Matrix3d& M) {
  return Plane(M.transpose() * plane_camera.normal(), plane_camera.rho());
}

struct Scene {
  SE3 T_true = mounting(), T_stated = mounting();
  Eigen::Matrix3d M = Eigen::Matrix3d::Identity();  // a stated point is here in truth
  bool wheels = true;
  double sway = 0;     // rad, of the body's pitch
  double stretch = 0;  // share, of depths, from image to image
  double bump = 0;     // m by which a level platform hides the floor
  bool floor = true;
  double offset = 0;  // 1/m, of all 1 / depths
  double way = 1;     // by wheels, over the true one
};

Eigen::Matrix3d scaled(double x, double y, double z) {
  return Eigen::Vector3d(x, y, z).asDiagonal();
}

MountingCheck check_of(const Scene& scene, const MountingCheckOptions& options = {}) {
  MountingCheck check(scene.T_stated, false, options);
  for (int k = 0; k < 30; ++k) {
    MountingView view;
    const SE3 T_odom_body(SO3::rot_z(0.12 * k),
                          {1.2 * std::cos(0.2 * k), 0.9 * std::sin(0.2 * k), 0});
    if (scene.wheels)
      view.T_odom_body = SE3(T_odom_body.so3(), scene.way * T_odom_body.translation());
    const SE3 T_sway(SO3::rot_y(scene.sway * std::sin(1.7 * k)), {0, 0, 0});
    const SE3 T_camera_map = (T_odom_body * T_sway * scene.T_true).inverse();
    const double stretch = 1 + scene.stretch * std::sin(2.3 * k);
    std::vector<Plane> planes{Plane({1, 0, 0}, -4), Plane({-1, 0, 0}, -3), Plane({0, 1, 0}, -2.5),
                              Plane({0, -1, 0}, -3.5)};
    if (scene.floor) planes.push_back(Plane({0, 0, 1}, scene.bump));
    for (const Plane& plane_map : planes) {
      const Plane seen = with_offset(T_camera_map * plane_map, scene.offset);
      view.planes.push_back({as_stated(seen, scene.M * stretch), 0.1});
    }
    check.add(std::move(view));
  }
  return check;
}

MountingVerdict verdict_of(const Scene& scene, const MountingCheckOptions& options = {}) {
  return check_of(scene, options).verdict();
}

void expect_found(const Scene& scene, const char* id, double ratio) {
  const MountingVerdict verdict = verdict_of(scene);
  EXPECT_TRUE(verdict.wrong) << id;
  EXPECT_EQ(verdict.best.id, id);
  EXPECT_NEAR(verdict.best.ratio, ratio, 0.02 * std::abs(ratio)) << id;
  EXPECT_GE(verdict.best.floors, 28U) << id;
}

TEST(MountingCheck, ARightCalibrationStands) {
  const MountingVerdict verdict = verdict_of({});
  EXPECT_FALSE(verdict.wrong) << verdict.best.id;
  EXPECT_FALSE(verdict.never_seen);
  EXPECT_EQ(verdict.stated.floors, 30U);
  EXPECT_LT(verdict.tilt_scatter, 1e-9);
  EXPECT_LT(verdict.height_scatter, 1e-9);
}

TEST(MountingCheck, ATapeMeasuresErrorsAreNoContradiction) {
  Scene scene;
  scene.T_true = mounting(0.84, 22.5);
  EXPECT_FALSE(verdict_of(scene).wrong);
}

TEST(MountingCheck, UpsideDownAndSidewaysImagesAreTurnedBack) {
  Scene scene;
  scene.T_true = SE3(scene.T_true.so3() * SO3::rot_z(M_PI), scene.T_true.translation());
  expect_found(scene, "camera_upside_down", 1);
  scene.T_true = SE3(mounting().so3() * SO3::rot_z(M_PI / 2), scene.T_true.translation());
  expect_found(scene, "camera_sideways", 1);
}

TEST(MountingCheck, AMissingOpticalRotationIsFoundWithAndWithoutTheTilt) {
  Scene scene;
  scene.T_stated = SE3(SO3(), {0.1, 0, 0.8});
  expect_found(scene, "camera_optical_rotation", 1);
  scene.T_stated = SE3(SO3::rot_y(20 * kDegree), {0.1, 0, 0.8});
  expect_found(scene, "camera_optical_rotation", 1);
  const SE3 T = *verdict_of(scene).best.correction.T_body_camera;
  EXPECT_LT((T.inverse() * mounting()).log().norm(), 0.01);
}

TEST(MountingCheck, TheFocalLengthOfOtherImagesIsToldFromDepthAndHeight) {
  Scene scene;
  for (const double focal : {0.5, 2.0}) {
    scene.M = scaled(1 / focal, 1 / focal, 1);
    expect_found(scene, "focal_length", focal);
  }
}

TEST(MountingCheck, WheelsTellAWrongUnitFromAWrongHeight) {
  Scene unit;
  for (const double depth : {5.0, 0.2, 1000.0, 0.7}) {
    unit.M = scaled(depth, depth, depth);
    expect_found(unit, "depth_scale", depth);
    EXPECT_FALSE(verdict_of(unit).rival);
  }
  Scene height;
  height.T_stated = mounting(1.4);
  expect_found(height, "camera_height", 0.8 / 1.4);
  EXPECT_FALSE(verdict_of(height).rival);
}

TEST(MountingCheck, AQuaternionWrittenWithItsRealPartFirstIsReadSo) {
  Scene scene;
  const Eigen::Vector4d xyzw = mounting().so3().quaternion().coeffs();
  // w x y z in the places of x y z w
  const Eigen::Quaterniond misread(xyzw(2), xyzw(3), xyzw(0), xyzw(1));
  scene.T_stated = SE3(SO3(misread), mounting().translation());
  expect_found(scene, "quaternion_order", 1);
  const SE3 T = *verdict_of(scene).best.correction.T_body_camera;
  EXPECT_LT((T.inverse() * mounting()).log().norm(), 1e-6);
}

TEST(MountingCheck, AnOffsetOfDisparitiesIsFoundByWallsThatComeNearer) {
  Scene scene;
  for (const double offset : {0.033, 0.1, -0.02}) {
    scene.offset = offset;
    const auto found = check_of(scene).depth_offset();
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->value, offset, 0.003);
    EXPECT_TRUE(found->clear && found->adoption.adopted && found->gain > 50) << offset;
  }
}

TEST(MountingCheck, NeitherARightCameraNorWheelsThatCountWrongHaveAnOffset) {
  Scene scene;
  for (const double way : {1.0, 0.85, 1.2}) {
    scene.way = way;
    const auto found = check_of(scene).depth_offset();
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->clear && found->gain > 50) << way;
  }
}

TEST(MountingCheck, WithoutWheelsBothAreNamed) {
  Scene height;
  height.T_stated = mounting(1.4);
  height.wheels = false;
  const MountingVerdict verdict = verdict_of(height);
  EXPECT_TRUE(verdict.wrong);
  ASSERT_TRUE(verdict.rival);
  EXPECT_NE(verdict.rival->id, verdict.best.id);
}

TEST(MountingCheck, ATiltOfTensOfDegreesIsMeasured) {
  Scene scene;
  scene.T_stated = mounting(0.8, -15);
  const MountingVerdict verdict = verdict_of(scene);
  EXPECT_EQ(verdict.best.id, "camera_tilt");
  EXPECT_NEAR(verdict.best.tilt, 35 * kDegree, 0.01);
}

TEST(MountingCheck, HeadingAndMirrorImagesAreToldByMotion) {
  Scene scene;
  scene.T_stated = SE3(SO3::rot_z(M_PI / 2) * mounting().so3(), mounting().translation());
  EXPECT_EQ(verdict_of(scene).best.id, "camera_heading");
  EXPECT_NEAR(verdict_of(scene).best.ratio, -M_PI / 2, 1e-9);
  Scene mirror;
  mirror.M = scaled(-1, 1, 1);
  EXPECT_EQ(verdict_of(mirror).best.id, "camera_mirrored");
  mirror.wheels = false;  // nobody can know
  EXPECT_FALSE(verdict_of(mirror).wrong);
}

TEST(MountingCheck, ACameraThatShowsNoFloorIsNotGuessedAt) {
  Scene scene;
  scene.floor = false;
  const MountingVerdict verdict = verdict_of(scene);
  EXPECT_FALSE(verdict.wrong) << verdict.best.id;
  EXPECT_TRUE(verdict.never_seen);
}

TEST(MountingCheck, BodiesThatPitchAndDepthThatIsStretchedScatter) {
  Scene pitching;
  pitching.sway = 2.5 * kDegree;
  EXPECT_GT(verdict_of(pitching).tilt_scatter, 1.2 * kDegree);
  EXPECT_FALSE(verdict_of(pitching).wrong);
  Scene stretched;
  stretched.stretch = 0.06;
  EXPECT_GT(verdict_of(stretched).height_scatter, 0.03);
  EXPECT_LT(verdict_of(stretched).tilt_scatter, 0.01);
}

// No number of the check is tuned to these scenes.
TEST(MountingCheck, HoldsWithItsNumbersMovedByAHalf) {
  Scene upside_down, unit;
  upside_down.T_true = SE3(mounting().so3() * SO3::rot_z(M_PI), mounting().translation());
  unit.M = scaled(5, 5, 5);
  for (const double by : {0.5, 1.5}) {
    for (double MountingCheckOptions::*number :
         {&MountingCheckOptions::sigma_tilt, &MountingCheckOptions::sigma_height,
          &MountingCheckOptions::sigma_wall_tilt, &MountingCheckOptions::sigma_wall,
          &MountingCheckOptions::wins_by, &MountingCheckOptions::clear_by,
          &MountingCheckOptions::price_known, &MountingCheckOptions::price_free}) {
      MountingCheckOptions options;
      options.*number *= by;
      EXPECT_FALSE(verdict_of({}, options).wrong);
      EXPECT_EQ(verdict_of(upside_down, options).best.id, "camera_upside_down");
      EXPECT_EQ(verdict_of(unit, options).best.id, "depth_scale");
    }
  }
}

TEST(MountingCheck, AFloorLiesWhereTheMountingSays) {
  const MountingCheck check(mounting(), false);
  const SE3 T_camera_map = mounting().inverse();
  const Plane floor = T_camera_map * Plane({0, 0, 1}, 0),
              table = T_camera_map * Plane({0, 0, 1}, 0.4);
  EXPECT_TRUE(check.shows_floor({{table, 0.2}, {floor, 0.1}}));
  EXPECT_FALSE(check.shows_floor({{floor, 0.01}})) << "a scrap";
  EXPECT_FALSE(check.shows_floor({{table, 0.2}}));
  EXPECT_FALSE(check.shows_floor({}));
}

TEST(MountingCheck, OneFloorInTwentyImagesIsNotHardlyAny) {
  EXPECT_TRUE((FloorsAsStated{100, 4}).hardly_any());
  EXPECT_FALSE((FloorsAsStated{100, 5}).hardly_any());
  EXPECT_FALSE((FloorsAsStated{0, 0}).hardly_any());
}

}  // namespace
}  // namespace lamina
