// Points, keyframes, scans and window sizes as the page reads them.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include <lamina/models/error.hpp>
#include <lamina/viewer/line_data.hpp>
#include <lamina/viewer/parts.hpp>

namespace lamina::viewer {
namespace {

using testing::HasSubstr;

class LineData : public testing::Test {
 protected:
  std::filesystem::path put(const std::string& content) const {
    const auto file = std::filesystem::path(testing::TempDir()) /
                      testing::UnitTest::GetInstance()->current_test_info()->name();
    std::ofstream(file) << content;
    return file;
  }
};

TEST(PointCloud, OnePointACell) {
  PointCloud cloud;
  cloud.add({1.001F, 2.001F, 0});
  cloud.add({1.002F, 2.003F, 0});
  cloud.add({-1.001F, 2.001F, 0});
  cloud.add({1.03F, 2.001F, 0});
  cloud.add({std::nanf(""), 0, 0});
  EXPECT_EQ(cloud.points().size(), 3U);
}

TEST(Parts, PointsAreThinnedAndGoodToAMillimetre) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 10; ++i) points.emplace_back(-3.0F + static_cast<float>(i), 5, 0.25F);
  const auto all = nlohmann::json::parse(points_text(points, 100));
  EXPECT_EQ(all.at("count"), 10);
  EXPECT_EQ(all.at("origin"), nlohmann::json({-3.0, 5.0, 0.25}));
  EXPECT_EQ(all.at("step"), 1e-3);
  EXPECT_EQ(all.at("codes").get<std::string>().size(), 80U);  // 10 x 6 bytes
  EXPECT_EQ(nlohmann::json::parse(points_text(points, 4)).at("count"), 4);
  EXPECT_EQ(nlohmann::json::parse(points_text({}, 4)).at("count"), 0);
}

TEST_F(LineData, KeyframesOfG2o) {
  const auto file =
      put("VERTEX_SE3:QUAT 0 1 2 3 0 0 0 1\nFIX 0\n"
          "VERTEX_SE3:QUAT 4 5 6 7 0 0 0.70710678 0.70710678\nVERTEX_PLANE 9 0 0 1 0 1 1 1\n"
          "VERTEX_SE3:QUAT 10 0 0 0 0 0 0 1\nFIX 10\n");  // the sensor's place
  const auto poses = keyframes_of(file);
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[1].translation(), Eigen::Vector3d(5, 6, 7));
  EXPECT_NEAR((poses[1].so3() * Eigen::Vector3d::UnitX()).y(), 1, 1e-6);
  EXPECT_EQ(nlohmann::json::parse(keyframes_text(poses)).at("count"), 2);
}

TEST_F(LineData, ScansLieAlongThePath) {
  Trajectory path;
  path.add(Timestamp::from_seconds(0), SE3());
  path.add(Timestamp::from_seconds(2), SE3(SO3(), {4, 0, 1}));
  // At 1 s the body is at x = 2; of its beams ahead, left and back one has no return. 5 s is past
  // it.
  const auto file =
      put("# a comment\n1.0,0,1.5707963267949,0.1,10,3,1,nan\n5.0,0,1,0.1,10,1,1,1\n");
  const auto points = scan_points(file, path);
  ASSERT_EQ(points.size(), 2U);
  EXPECT_TRUE(points[0].isApprox(Eigen::Vector3f(5, 0, 0.5F), 1e-5F));
  EXPECT_TRUE(points[1].isApprox(Eigen::Vector3f(2, 1, 0.5F), 1e-5F));
}

TEST_F(LineData, FaultsNameTheLine) {
  const auto message = [&](auto&& read) {
    try {
      read();
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  const auto file = put("# a comment\n1,2,x\n");
  EXPECT_THAT(message([&] { scan_points(file, {}); }), HasSubstr(":2"));
  EXPECT_THAT(message([&] { edge_points(file); }), HasSubstr(":2"));
  EXPECT_THAT(message([&] { window_series(file); }), HasSubstr(":2"));
  const auto g2o = put("VERTEX_SE3:QUAT 0 1 2 3 0 0 0 0\n");
  EXPECT_THAT(message([&] { keyframes_of(g2o); }), HasSubstr(":1"));
}

TEST_F(LineData, WindowsAndEdges) {
  const auto series =
      window_series(put("timestamp,keyframes,residuals,solve_ms\n1.5,20,300,4.25\n"));
  EXPECT_EQ(series.times, std::vector<double>{1.5});
  EXPECT_EQ(series.keyframes, std::vector<double>{20});
  EXPECT_EQ(series.solve_ms, std::vector<double>{4.25});
  EXPECT_EQ(edge_points(put("x,y,z,sigma\n1,2,3,0.1\n")).size(), 1U);
}

}  // namespace
}  // namespace lamina::viewer
