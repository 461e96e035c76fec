// planes.json: its keys, and the way back.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

namespace fs = std::filesystem;

MapPlane a_wall() {
  MapPlane plane;
  plane.id = 7;
  plane.label = PlaneLabel::kWall;
  plane.plane_map = Plane({-1, 0, 0}, -2.5);
  plane.centroid_map = {2.5, 1, 1};
  plane.covariance = Eigen::Vector3d(4e-6, 9e-6, 1e-4).asDiagonal();
  plane.outlines_map = {{{2.5, 0, 0}, {2.5, 2, 0}, {2.5, 2, 2}, {2.5, 0, 2}},
                        {{2.5, 3, 0}, {2.5, 4, 0}, {2.5, 4, 1}}};
  plane.ring_map = {{2.5, 0, 0}, {2.5, 4, 0}, {2.5, 4, 1}, {2.5, 3, 0.1}, {2.5, 2, 2}, {2.5, 0, 2}};
  plane.area = 4.5;
  plane.observations = 12;
  plane.first_seen = Timestamp::from_seconds(10);
  plane.last_seen = Timestamp::from_seconds(20.5);
  return plane;
}

class MapFiles : public testing::Test {
 protected:
  void TearDown() override { fs::remove(file_); }
  fs::path file_ = fs::temp_directory_path() /
                   (std::string("lamina_planes_") +
                    testing::UnitTest::GetInstance()->current_test_info()->name() + ".json");
};

TEST_F(MapFiles, PlanesHaveTheKeysOfTheContract) {
  write_planes_json(file_, {a_wall()});
  std::ifstream in(file_);
  const auto json = nlohmann::json::parse(in);
  const auto& plane = json.at("planes").at(0);
  for (const char* key :
       {"id", "label", "normal", "rho", "theta", "phi", "sigma_rho", "sigma_angle", "boundary",
        "area", "observations", "first_seen", "last_seen"}) {
    EXPECT_TRUE(plane.contains(key)) << key;
  }
  EXPECT_EQ(plane["label"], "wall");
  EXPECT_DOUBLE_EQ(plane["sigma_rho"].get<double>(), 0.01);
  EXPECT_NEAR(plane["sigma_angle"].get<double>(), 0.003, 1e-12);
  EXPECT_EQ(plane["boundary"].size(), 6u);  // one ring round both parts
  EXPECT_EQ(plane["parts"].size(), 2u);
  EXPECT_NEAR(plane["theta"].get<double>(), M_PI / 2, 1e-12);
  EXPECT_NEAR(plane["phi"].get<double>(), M_PI, 1e-12);
}

TEST_F(MapFiles, CovariancesComeBackWithThoseOfTheMountings) {
  MapPlane wall = a_wall();
  wall.plane_map = Plane({-0.8, 0.55, 0.2}, -2.5);
  wall.covariance << 4e-6, 1e-6, 2e-6, 1e-6, 9e-6, -3e-6, 2e-6, -3e-6, 1e-4;
  wall.covariance_mounting(2, 2) = 3e-4;
  write_planes_json(file_, {wall});
  const MapPlane back = read_planes_json(file_).at(0);
  EXPECT_TRUE(back.covariance.isApprox(wall.covariance, 1e-9)) << back.covariance;
  EXPECT_TRUE(back.covariance_mounting.isApprox(wall.covariance_mounting, 1e-9));
  EXPECT_NEAR(plane_sigmas(wall).rho, 0.02, 1e-12);
}

TEST_F(MapFiles, FilesWithoutCovariancesGiveThoseOfTheirSigmas) {
  write_planes_json(file_, {a_wall()});
  auto json = nlohmann::json::parse(std::ifstream(file_));
  json["planes"][0].erase("covariance");
  std::ofstream(file_) << json;
  const Eigen::Matrix3d C = read_planes_json(file_).at(0).covariance;
  EXPECT_TRUE(C.diagonal().isApprox(Eigen::Vector3d(9e-6, 9e-6, 1e-4), 1e-9)) << C;
}

// Stamps are decimals to the nanosecond: no digits that only the double has.
TEST_F(MapFiles, StampsHaveNoBinaryNoise) {
  MapPlane early = a_wall(), late = a_wall();
  // 1e-9 times these is beside the nearest double.
  early.first_seen = Timestamp::from_nanoseconds(1'000'000'000'000);
  early.last_seen = Timestamp::from_nanoseconds(1'001'100'000'000);
  late.first_seen = Timestamp::from_nanoseconds(1'341'836'538'891'350'000);
  late.last_seen = Timestamp::from_nanoseconds(1'305'031'102'175'304'000);
  write_planes_json(file_, {early, late});
  std::ifstream in(file_);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  for (const char* line :
       {"\"first_seen\": 1000.0,", "\"last_seen\": 1001.1,", "\"first_seen\": 1341836538.89135,",
        "\"last_seen\": 1305031102.175304,"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line << " in\n" << text;
  }
}

TEST_F(MapFiles, PlanesReadBackTheSame) {
  write_planes_json(file_, {a_wall()});
  const auto planes = read_planes_json(file_);
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].id, 7);
  EXPECT_EQ(planes[0].label, PlaneLabel::kWall);
  EXPECT_EQ(planes[0].plane_map.normal(), a_wall().plane_map.normal());
  EXPECT_EQ(planes[0].plane_map.rho(), -2.5);
  EXPECT_EQ(planes[0].outlines_map, a_wall().outlines_map);
  EXPECT_EQ(planes[0].ring_map, a_wall().ring_map);
  EXPECT_EQ(planes[0].observations, 12);
}

TEST_F(MapFiles, SaysWhatIsWrongWithDamagedPlanes) {
  for (const char* text : {"", "{", "{\"planes\": [{\"id\": 1}]}", "{\"planes\": [3]}", "[]"}) {
    write_atomically(file_, text);
    try {
      read_planes_json(file_);
      ADD_FAILURE() << "expected an error for " << text;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("planes.json"), std::string::npos) << text;
    }
  }
  EXPECT_THROW(read_planes_json(file_ / "none"), Error);
}

}  // namespace
}  // namespace lamina::io
