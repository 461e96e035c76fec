// --calibration: what a file states counts, the rest stays as the recording has it.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/readers/transform_tree.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

fs::path write(const std::string& name, const std::string& text) {
  const fs::path file = fs::path(testing::TempDir()) / name;
  std::ofstream(file) << text;
  return file;
}

CalibrationOverlay overlay(const std::string& text) {
  return CalibrationOverlay(write("overlay.yaml", text));
}

std::string message(const std::string& text) {
  try {
    overlay(text);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(CalibrationOverlay, TakesWhatIsStatedAlone) {
  const auto given = overlay("lidar: {range_sigma: 0.03}\nodometry: {planar: false}\n");
  LidarModel lidar;
  lidar.T_body_lidar = SE3::planar(0.2, 0, 0.1);
  lidar.noise.angle_sigma = 0.004;
  given.apply(lidar);
  EXPECT_DOUBLE_EQ(lidar.noise.range_sigma, 0.03);
  EXPECT_DOUBLE_EQ(lidar.noise.angle_sigma, 0.004);
  EXPECT_DOUBLE_EQ(lidar.T_body_lidar.translation().x(), 0.2);
  OdometryModel odometry;
  odometry.sigma_rotation = 0.5;
  given.apply(odometry);
  EXPECT_FALSE(odometry.planar);
  EXPECT_DOUBLE_EQ(odometry.sigma_rotation, 0.5);
  EXPECT_TRUE(given.states("lidar.range_sigma"));
  EXPECT_FALSE(given.states("lidar.T_body_lidar"));
  EXPECT_FALSE(given.states("depth_camera"));
}

TEST(CalibrationOverlay, ANewFocalLengthTakesItsNoiseAlong) {
  DepthCamera depth;
  depth.camera.width = 320;
  depth.camera.fx = depth.camera.fy = 525;
  depth.noise = DepthNoise::stereo(525, 0.12, 0.3);
  overlay("depth_camera: {fx: 262.5, fy: 262.5}\n").apply(depth);
  EXPECT_EQ(depth.camera.width, 320);
  EXPECT_DOUBLE_EQ(depth.noise.focal_baseline, 262.5 * 0.12);
  EXPECT_DOUBLE_EQ(depth.noise.disparity_sigma, 0.3);
  overlay("depth_camera: {model: ideal}\n").apply(depth);
  EXPECT_EQ(depth.noise.kind, DepthNoise::Kind::kIdeal);
  EXPECT_DOUBLE_EQ(depth.camera.fx, 262.5);
}

TEST(CalibrationOverlay, NothingGivenChangesNothing) {
  const CalibrationOverlay none(std::optional<fs::path>{});
  DepthCamera depth;
  none.apply(depth);
  EXPECT_EQ(depth.camera.width, 0);
  EXPECT_FALSE(none.states("lidar"));
}

TEST(CalibrationOverlay, MistakesAreSaidWhateverTheRecordingHolds) {
  EXPECT_THAT(message("lidar: {range_sigm: 0.03}\n"), HasSubstr("did you mean 'range_sigma'"));
  EXPECT_THAT(message("lidra: {range_sigma: 0.03}\n"), HasSubstr("did you mean 'lidar'"));
  EXPECT_THAT(message("stereo_camera: {baseline: -1}\n"), HasSubstr("a baseline above 0"));
  EXPECT_THAT(message("depth_camera: {fx: 0}\n"), HasSubstr("a focal length above 0"));
}

constexpr const char* kLog = "FLASER 3 1.0 1.0 1.0 0 0 0 0 0 0 1.0 host 1.0\n";

TEST(CalibrationOverlay, ACarmenLogSaysWhatWasAssumed) {
  const std::string log =
      "FLASER 3 1.0 1.0 1.0 0.1 0 0 0 0 0 1.0 host 1.0\n"
      "FLASER 3 1.0 1.0 1.0 0.3 0 0 0 0 0 2.0 host 2.0\n";
  const fs::path file = write("moving_mount.log", log);
  const auto recording = open_recording(file.string());
  EXPECT_THAT(recording->assumed(),
              ElementsAre(HasSubstr("range_sigma"), HasSubstr("front laser at the body's origin")));
  RecordingOptions options;
  options.calibration = write("overlay.yaml",
                              "lidar:\n  range_sigma: 0.02\n  T_body_lidar: {translation: "
                              "[0.3, 0, 0.2], rotation_xyzw: [0, 0, 0, 1]}\n");
  const auto stated = open_recording(file.string(), options);
  EXPECT_THAT(stated->assumed(), IsEmpty());
  const auto first = stated->next();
  ASSERT_TRUE(first.has_value());
  for (auto m = first; m; m = stated->next()) {
    if (const auto* scan = std::get_if<LaserScan>(&*m)) {
      EXPECT_DOUBLE_EQ(scan->lidar.T_body_lidar.translation().x(), 0.3);
      EXPECT_DOUBLE_EQ(scan->lidar.noise.range_sigma, 0.02);
    }
  }
  EXPECT_THAT(open_recording(write("fixed.log", kLog).string())->assumed(),
              ElementsAre(HasSubstr("range_sigma")));
}

TEST(CalibrationOverlay, AFolderKeepsItsOwn) {
  const fs::path folder = fs::path(testing::TempDir()) / "overlay_folder";
  fs::create_directories(folder);
  std::ofstream(folder / "calibration.yaml") << "lidar: {range_sigma: 0.01, angle_sigma: 0.002}\n";
  std::ofstream(folder / "scans.csv") << "1,0,0.1,0,10,1,1,1\n";
  RecordingOptions options;
  options.calibration = write("overlay.yaml", "lidar: {range_sigma: 0.05}\n");
  const auto recording = open_recording(folder.string(), options);
  EXPECT_DOUBLE_EQ(recording->calibration().lidar->noise.range_sigma, 0.05);
  EXPECT_DOUBLE_EQ(recording->calibration().lidar->noise.angle_sigma, 0.002);
}

TEST(TransformTree, NamesTheLinkThatIsMissing) {
  TransformTree tree;
  tree.add("base_link", "base_footprint", SE3());
  tree.add("mast", "laser", SE3());
  EXPECT_EQ(tree.missing_link("base_link", "laser"),
            "tf has no link between 'base_link' (with 'base_footprint') and 'laser' (with 'mast')");
  EXPECT_THAT(tree.missing_link("base_link", "camera"), HasSubstr("'camera' (alone)"));
  EXPECT_THAT(tree.missing_link("", "camera"), HasSubstr("a body frame, which nothing names"));
}

}  // namespace
}  // namespace lamina
