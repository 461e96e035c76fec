// A ramp between two halls, by camera, scanner and wheels.
#include <nlohmann/json.hpp>

#include <lamina/pipeline/evaluation/evaluation.hpp>

#include <lamina/frontend/motion/out_of_plane_motion.hpp>

#include "pipeline/faulty_room.hpp"
#include "pipeline/run_map.hpp"

namespace lamina {
namespace {

// Up the ramp and onto the upper floor.
void simulate_climb(const fs::path& data) {
  sim::DatasetOptions options;
  options.max_duration = 21;
  options.grid = false;
  sim::write_dataset(sim::make_scene("ramp", {{"path.speed", "1"},
                                              {"path.turn_rate", "1.6"},
                                              {"camera.rate_hz", "6"},
                                              {"lidar.rate_hz", "6"}}),
                     data, options);
}

struct Climb {
  double ate = 0, end_height = 0;
  int doubtful_walls = 0;  // that stand across the ramp
};

Climb climb(bool online, const std::vector<std::string>& settings = {}) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_climb(data);
  MapRequest request;
  request.input = data.string();
  request.output = folder.path() / "map";
  request.online = online;
  request.assignments = settings;
  EXPECT_TRUE(run_map(request));
  Climb result;
  const Trajectory path = Trajectory::read_tum(request.output / "trajectory.txt");
  result.end_height = path[path.size() - 1].pose.translation().z();
  result.ate = evaluate(request.output, data).trajectory->ate_m.rmse;
  std::ifstream in(request.output / "planes.json");
  const nlohmann::json planes = nlohmann::json::parse(in);  // outlives the loop
  for (const auto& plane : planes["planes"]) {
    const double x = plane["centroid"][0], y = plane["centroid"][1];
    const double nx = plane["normal"][0];
    if (x > 6.2 && x < 11.8 && std::abs(y) < 1.2 && std::abs(nx) > 0.7) ++result.doubtful_walls;
  }
  return result;
}

constexpr double kRise = 0.525;  // m: 6 m at 5 degrees

TEST(Slopes, ARampIsClimbedOffline) {
  const Climb up = climb(false);
  EXPECT_LT(up.ate, 0.02);
  EXPECT_NEAR(up.end_height, kRise, 0.02);
  EXPECT_EQ(up.doubtful_walls, 0);
}

TEST(Slopes, ARampIsClimbedOnline) {
  const Climb up = climb(true);
  EXPECT_LT(up.ate, 0.04);
  EXPECT_NEAR(up.end_height, kRise, 0.06);
  EXPECT_EQ(up.doubtful_walls, 0);
}

TEST(Slopes, AskedNotToFollowTheyAreTakenForLevel) {
  EXPECT_NEAR(climb(false, {"slopes.follow=false"}).end_height, 0, 0.02);
}

TEST(SlopeMotion, AddsHeightAndTiltAlone) {
  const SE3 flat = SE3::planar(0.4, 0.02, 0.1);
  Vector6d off = Vector6d::Zero();
  off.segment<3>(2) << 0.03, 0.002, -0.08;
  Vector6d all = off;
  all(0) = 0.01;
  all(5) = 0.02;
  const Matrix6d C = 1e-6 * Matrix6d::Identity();
  const Increment level{flat, C}, observed{flat * SE3::exp(all), 4 * C};
  const Lift lift = Lift::between(level, observed);
  EXPECT_LT((lift.off - off).norm(), 1e-12);
  const Increment whole = lift.applied(level);
  EXPECT_LT(((flat.inverse() * whole.T_from_to).log() - off).norm(), 1e-12);
  EXPECT_EQ(whole.covariance(0, 0), 1e-6);
  EXPECT_EQ(whole.covariance(4, 4), 4e-6);
  // Two halves of the way make the whole of it.
  const Increment half = lift.applied({SE3(), C}, 0.5);
  EXPECT_LT((half.T_from_to * half.T_from_to).log().isApprox(off, 1e-12) ? 0 : 1, 1);
  EXPECT_EQ(half.covariance(2, 2), 2e-6);
}

TEST(SlopeMotion, SharesMakeTheWhole) {
  // Half a metre in five steps while the body's nose goes up by 8 degrees, and turns.
  const Matrix6d C = 1e-6 * Matrix6d::Identity();
  std::vector<Increment> motions(5, Increment{SE3::planar(0.1, 0, 0.06), C});
  SE3 level;
  for (const Increment& one : motions) level = level * one.T_from_to;
  Vector6d off = Vector6d::Zero();
  off.segment<3>(2) << 0.035, 0.01, -0.14;
  const Increment observed{level * SE3::exp(off), 4 * C};
  share_out(observed, motions);
  Increment sum{SE3(), Matrix6d::Zero()};
  for (const Increment& one : motions) {
    sum.T_from_to = sum.T_from_to * one.T_from_to;
    sum.covariance += one.covariance;
  }
  EXPECT_LT(Lift::between(sum, observed).off.norm(), 1e-4);
  EXPECT_NEAR(sum.covariance(2, 2), 4e-6, 1e-12);
}

TEST(SlopeMotion, IsOpenTheMoreTheLongerTheWay) {
  const Increment level{SE3(), Matrix6d::Zero()};
  const Increment near = open_to_slopes(level, 0.1), far = open_to_slopes(level, 1);
  for (const int k : {2, 3, 4}) EXPECT_GT(far.covariance(k, k), near.covariance(k, k));
  for (const int k : {0, 1, 5}) EXPECT_EQ(far.covariance(k, k), 0);
}

}  // namespace
}  // namespace lamina
