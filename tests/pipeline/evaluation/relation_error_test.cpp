// Errors over relations, alignments and pairing by index, on paths whose errors are known.
#include <gtest/gtest.h>

#include <fstream>

#include <lamina/models/error.hpp>
#include <lamina/pipeline/evaluation/evaluation.hpp>

namespace lamina {
namespace {

Timestamp at(double seconds) { return Timestamp::from_seconds(seconds); }

Trajectory circle(double turn_sign = 1) {
  Trajectory path;
  for (int i = 0; i < 100; ++i) {
    const double a = 0.05 * i;
    path.add(at(0.1 * i), SE3::planar(std::sin(a), turn_sign * (1 - std::cos(a)), turn_sign * a));
  }
  return path;
}

std::filesystem::path written(const std::string& name, const std::string& text) {
  const auto file = std::filesystem::path(testing::TempDir()) / name;
  std::ofstream(file) << text;
  return file;
}

TEST(RelationError, IsTheMotionTheRelationLacks) {
  const Trajectory path = circle();
  const SE3 moved = path[10].pose.inverse() * path[40].pose;
  const SE3 error(SO3::rot_z(0.01), {0.03, 0.04, 0});
  const auto errors = relation_errors(
      path,
      {{at(1), at(4), moved}, {at(1), at(4), moved * error.inverse()}, {at(1), at(400), moved}});
  EXPECT_EQ(errors.translation_m.count, 2);
  EXPECT_EQ(errors.without_pose, 1);
  EXPECT_NEAR(errors.translation_m.max, 0.05, 1e-9);
  EXPECT_NEAR(errors.translation_m.mean, 0.025, 1e-9);
  EXPECT_NEAR(errors.translation_m.deviation(), 0.025, 1e-9);
  EXPECT_NEAR(errors.rotation_deg.max, 0.01 * 180 / M_PI, 1e-9);
  EXPECT_EQ(errors.worst.T_from_to.translation(), (moved * error.inverse()).translation());
}

TEST(RelationError, ReadsLinesAndNamesTheOneThatIsNone) {
  const auto good =
      written("good.relations", "# t1 t2\n1.5 2.5 0.1 0.2 0.3 0 0 1.5707963267948966\n");
  const auto relations = read_relations(good);
  ASSERT_EQ(relations.size(), 1u);
  EXPECT_EQ(relations[0].to, at(2.5));
  EXPECT_NEAR(
      (relations[0].T_from_to * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0.1, 1.2, 0.3)).norm(),
      0, 1e-12);
  const auto bad = written("bad.relations", "1 2 0 0 0 0 0 0\n1 2 0 0 0 x 0 0\n");
  try {
    read_relations(bad);
    FAIL() << "read a line that is none";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("bad.relations:2: found 'x'"), std::string::npos)
        << error.what();
  }
  EXPECT_THROW(read_relations(written("none.relations", "# nothing\n")), Error);
}

// A level path and its mirror image are one by a half turn about a level axis, not by yaw.
TEST(Alignment, ByYawAMirroredPathDoesNotPass) {
  const auto by_se3 = trajectory_error(circle(-1), circle());
  const auto by_yaw = trajectory_error(circle(-1), circle(), 0.5, Alignment::kYaw);
  ASSERT_TRUE(by_se3 && by_yaw);
  EXPECT_LT(by_se3->ate_m.rmse, 1e-9);
  EXPECT_GT(by_yaw->ate_m.rmse, 0.3);
}

TEST(Alignment, ByYawUndoesATurnAndAnOffset) {
  Trajectory moved;
  const SE3 T(SO3::rot_z(2.1), {5, -3, 1});
  for (const auto& [stamp, pose] : circle()) moved.add(stamp, T * pose);
  const auto by_yaw = trajectory_error(moved, circle(), 0.5, Alignment::kYaw);
  const auto not_moved = trajectory_error(moved, circle(), 0.5, Alignment::kNone);
  ASSERT_TRUE(by_yaw && not_moved);
  EXPECT_LT(by_yaw->ate_m.rmse, 1e-9);
  EXPECT_LT(by_yaw->ate_deg.rmse, 1e-5);
  EXPECT_GT(not_moved->ate_m.rmse, 1);
  EXPECT_EQ(not_moved->T_reference_estimate.translation(), Eigen::Vector3d::Zero());
}

TEST(PairedByIndex, ForgetsTheReferencesStamps) {
  Trajectory reference;
  for (std::size_t i = 0; i < 90; ++i) reference.add(at(1000.0 + double(i)), circle()[i].pose);
  const Trajectory paired = paired_by_index(circle(), reference);
  ASSERT_EQ(paired.size(), 90u);
  EXPECT_EQ(paired[40].stamp, circle()[40].stamp);
  const auto error = trajectory_error(circle(), paired);
  ASSERT_TRUE(error);
  EXPECT_LT(error->ate_m.rmse, 1e-12);
}

}  // namespace
}  // namespace lamina
