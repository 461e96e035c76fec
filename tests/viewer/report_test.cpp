// The report of a small map: what is in it, what is left out, what is refused.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include <lamina/models/error.hpp>
#include <lamina/viewer/page.hpp>
#include <lamina/viewer/report.hpp>

#include "viewer/sample_map.hpp"

namespace lamina::viewer {
namespace {

using testing::HasSubstr;
using testing::Not;

class Report : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
    write_sample_map(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string page() const {
    write_report(folder_);
    std::ostringstream text;
    text << std::ifstream(folder_ / "report.html").rdbuf();
    return text.str();
  }
  static nlohmann::json data_of(const std::string& page) {
    const std::string open = "<script id=\"data\" type=\"application/json\">";
    const auto at = page.find(open) + open.size();
    return nlohmann::json::parse(page.substr(at, page.find("</script>", at) - at));
  }
  void put(const char* name, const std::string& content) const {
    std::ofstream(folder_ / name) << content;
  }
  std::string error() const {
    try {
      write_report(folder_);
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  }

  std::filesystem::path folder_;
};

TEST_F(Report, HoldsTheMap) {
  const auto data = data_of(page());
  ASSERT_EQ(data.at("planes").size(), static_cast<std::size_t>(kSamplePlanes));
  EXPECT_EQ(data.at("planes")[2].at("id"), 7);
  EXPECT_EQ(data.at("planes")[2].at("label"), "ramp");
  EXPECT_EQ(data.at("planes")[0].at("outlines")[0].size(), 4U);
  EXPECT_NEAR(data.at("planes")[1].at("sigma_rho").get<double>(), 2e-3, 1e-9);
  EXPECT_EQ(data.at("trajectory").at("count"), 101);
  EXPECT_NEAR(data.at("trajectory").at("length").get<double>(), 4.0, 1e-6);
  EXPECT_EQ(data.at("grid").at("width"), 40);
  EXPECT_EQ(data.at("grid").at("layers").size(), 4U);
  EXPECT_FALSE(data.at("occupancy").at("layers").at("occupancy").at("codes").empty());
  EXPECT_EQ(data.at("path").size(), 3U);
  EXPECT_EQ(data.at("keyframes").at("count"), 2);
  EXPECT_EQ(data.at("points").at("count"), 6);
  EXPECT_EQ(data.at("edges").at("count"), 3);
  EXPECT_EQ(data.at("window").at("times"), nlohmann::json({0.0, 5.0}));
  EXPECT_EQ(data.at("window").at("keyframes"), nlohmann::json({1.0, 2.0}));
}

TEST_F(Report, TimesCountFromTheFirstPose) {
  const auto data = data_of(page());
  EXPECT_EQ(data.at("evaluation").at("trajectory").at("times"), nlohmann::json({0.0, 1.0}));
}

TEST_F(Report, LoadsNothingFromElsewhere) {
  const std::string text = page();
  EXPECT_THAT(text, HasSubstr("Content-Security-Policy\" content=\"default-src 'none'"));
  for (const char* load : {"src=\"http", "href=\"http", "src='http", "url(http", "@import", "<link",
                           "<iframe", "src=\"//"}) {
    EXPECT_THAT(text, Not(HasSubstr(load))) << load;
  }
  EXPECT_LT(text.size(), 1000000U);
}

// More of everything than the page takes, and noise, which nothing packs.
TEST_F(Report, LargeMapStaysSmall) {
  std::uint32_t x = 1;
  const auto noise = [&x] {
    x = x * 1664525U + 1013904223U;
    return static_cast<float>(x >> 8U) / static_cast<float>(1U << 24U);
  };
  NavigabilityGrid grid(0.05);
  for (int i = 0; i < 1100; ++i) {
    for (int j = 0; j < 1000; ++j) grid.at_or_new({i, j}) = {noise(), noise(), noise(), noise()};
  }
  io::write_grid(folder_ / "grid", grid);
  const GridGeometry bounds = known_bounds(grid);
  io::write_occupancy_map(folder_, bounds, [&](int row, float* values) {
    layer_row(grid, bounds, row, &NavigabilityCell::confidence, values);
  });
  io::write_surfels_ply(folder_ / "surfels.ply", std::vector<Surfel>(160000));
  Trajectory path;
  for (int i = 0; i < 25000; ++i) {
    path.add(Timestamp::from_seconds(i), SE3(SO3(), {0.01 * i, noise(), 0}));
  }
  io::write_trajectory(folder_ / "trajectory.txt", path);
  io::write_trajectory(folder_ / "trajectory_before.txt", path);
  {
    std::ofstream scans(folder_ / "scans.csv");
    for (int i = 0; i < 2000; ++i) {
      scans << i << ",-3,0.06,0.1,50";
      for (int k = 0; k < 100; ++k) scans << ',' << 1 + 40 * noise();
      scans << '\n';
    }
  }
  const std::string text = page();
  EXPECT_LT(text.size(), 15'000'000U);
  const auto data = data_of(text);
  EXPECT_EQ(data.at("points").at("count"), data.at("points").at("total").get<std::size_t>() / 2);
  EXPECT_EQ(data.at("surfels").at("total"), 160000);
  EXPECT_GT(data.at("grid").at("step"), 1);
}

TEST_F(Report, TextOfTheMapCannotEndTheScript) {
  const std::string text = page();
  EXPECT_THAT(text, Not(HasSubstr("</script><b>")));
  EXPECT_EQ(data_of(text).at("metrics").at("skipped").at("</script><b>"), 3);
}

TEST_F(Report, LeavesOutWhatIsNotThere) {
  for (const char* name : {"trajectory_before.txt", "metrics.json", "evaluation.json", "path.csv",
                           "occupancy.pgm", "planes.json"}) {
    std::filesystem::remove(folder_ / name);
  }
  std::filesystem::remove_all(folder_ / "grid");
  const auto data = data_of(page());
  EXPECT_FALSE(data.contains("grid"));
  EXPECT_FALSE(data.contains("before"));
  EXPECT_FALSE(data.contains("metrics"));
  EXPECT_TRUE(data.at("planes").empty());
  EXPECT_TRUE(data.contains("trajectory"));
}

TEST_F(Report, SurfelsOfAPly) {
  Surfel surfel;
  io::write_surfels_ply(folder_ / "surfels.ply", {surfel, surfel});
  const auto data = data_of(page());
  EXPECT_EQ(data.at("surfels").at("count"), 2);
  EXPECT_EQ(data.at("surfels").at("position").get<std::string>().size(), 32U);  // 24 bytes
}

// Places of a map in UTM coordinates are doubles.
TEST_F(Report, SurfelsFarFromTheOrigin) {
  Surfel surfel;
  surfel.center = {400000, 5000000, 0};
  surfel.radius = 0.5;
  io::write_surfels_ply(folder_ / "surfels.ply", {surfel});
  const auto data = data_of(page());
  EXPECT_EQ(data.at("surfels").at("position"), "AFDDSICWmEoAAAAA");  // floats, little-endian
  EXPECT_EQ(data.at("surfels").at("radius"), "AAAAPw==");
}

TEST_F(Report, ErrorsNameTheFile) {
  put("surfels.ply", "ply\nformat ascii 1.0\nend_header\n");
  EXPECT_THAT(error(), HasSubstr("surfels.ply"));
  put("surfels.ply", "ply\nelement vertex 99999999999999999999999\nend_header\n");
  EXPECT_THAT(error(), HasSubstr("surfels.ply:2"));
  std::filesystem::remove(folder_ / "surfels.ply");
  put("path.csv", "x,y\n1,2\n3;4\n");
  EXPECT_THAT(error(), HasSubstr("path.csv:3"));
  put("occupancy.pgm", "P5\n40 30\n255\nshort");
  EXPECT_THAT(error(), HasSubstr("occupancy.pgm"));
  put("occupancy.pgm", "P5\n40 30\n255");
  EXPECT_THAT(error(), HasSubstr("0 pixels"));
  put("metrics.json", "{");
  EXPECT_THAT(error(), HasSubstr("metrics.json"));
  put("planes.json", R"({"planes": [{"id": 1}]})");
  EXPECT_THAT(error(), HasSubstr("planes.json"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "report.html"));
}

TEST_F(Report, RefusesAFolderWithoutAMap) {
  std::filesystem::remove(folder_ / "planes.json");
  std::filesystem::remove(folder_ / "trajectory.txt");
  EXPECT_THAT(error(), HasSubstr("neither planes.json nor trajectory.txt"));
}

}  // namespace
}  // namespace lamina::viewer
