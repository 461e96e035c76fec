// Generated plane graphs: records, truth, statistics.
#include <lamina/pipeline/evaluation/plane_graph_sim.hpp>

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <sstream>

#include <lamina/models/error.hpp>
#include <lamina/models/moments.hpp>
#include <lamina/models/plane.hpp>

namespace lamina::sim {
namespace {

struct Parsed {
  std::vector<SE3> truth, init;
  std::vector<Plane> planes;
  std::map<std::int64_t, SE3> odometry;
  struct Observation {
    std::size_t pose, plane;
    Eigen::Matrix4d M;
  };
  std::vector<Observation> observations;
};

Parsed parse(const std::string& text) {
  Parsed out;
  std::istringstream in(text);
  std::string line, kind;
  while (std::getline(in, line)) {
    std::istringstream row(line);
    std::int64_t i = 0, j = 0;
    row >> kind;
    if (kind == "SIG") continue;
    row >> i;
    if (kind == "ODO" || kind == "OBS") row >> j;
    std::vector<double> v;
    for (double x; row >> x;) v.push_back(x);
    const auto pose = [&] {
      return SE3(SO3(Eigen::Quaterniond(v[3], v[0], v[1], v[2])), {v[4], v[5], v[6]});
    };
    if (kind == "GT") out.truth.push_back(pose());
    if (kind == "INIT") out.init.push_back(pose());
    if (kind == "PLANE") out.planes.emplace_back(Eigen::Vector3d(v[0], v[1], v[2]), v[3]);
    if (kind == "ODO") out.odometry.emplace(i, pose());
    if (kind == "OBS") {
      Eigen::Matrix4d M;
      M << v[0], v[1], v[2], v[3], v[1], v[4], v[5], v[6], v[2], v[5], v[7], v[8], v[3], v[6], v[8],
          v[9];
      out.observations.push_back({static_cast<std::size_t>(i), static_cast<std::size_t>(j), M});
    }
  }
  return out;
}

PlaneGraphOptions small() {
  PlaneGraphOptions o;
  o.rooms_x = o.rooms_y = 3;
  o.storeys = 1;
  o.poses_per_room = 11;
  return o;
}

TEST(PlaneGraphSim, CountsAndSameBytes) {
  std::ostringstream a, b;
  const PlaneGraphCounts counts = write_plane_graph(small(), a);
  write_plane_graph(small(), b);
  EXPECT_EQ(a.str(), b.str());
  const Parsed graph = parse(a.str());
  EXPECT_EQ(counts.poses, 198);
  EXPECT_EQ(counts.planes, 63);
  EXPECT_EQ(graph.truth.size(), 198u);
  EXPECT_EQ(graph.planes.size(), 63u);
  EXPECT_EQ(graph.odometry.size(), 197u);
  EXPECT_EQ(static_cast<std::int64_t>(graph.observations.size()), counts.observations);
  // As many as the published problems have: 4.4 planes a pose.
  EXPECT_NEAR(static_cast<double>(counts.observations) / static_cast<double>(counts.poses), 4.4,
              0.4);
}

TEST(PlaneGraphSim, ObservationsFitTruthWithThePointNoise) {
  std::ostringstream text;
  write_plane_graph(small(), text);
  const Parsed graph = parse(text.str());
  double chi2 = 0, points = 0;
  for (const auto& o : graph.observations) {
    const Plane plane_sensor = graph.truth[o.pose].inverse() * graph.planes[o.plane];
    EXPECT_LT(plane_sensor.rho(), 0) << "the sensor is on the positive side";
    const Eigen::Vector4d p = plane_sensor.homogeneous();
    chi2 += p.dot(o.M * p) / (0.01 * 0.01);
    points += o.M(3, 3);
  }
  EXPECT_NEAR(chi2 / points, 1, 0.03);
}

TEST(PlaneGraphSim, OdometryHasItsSigmasAndInitIsItsChain) {
  PlaneGraphOptions options = small();
  options.storeys = 4;
  std::ostringstream text;
  write_plane_graph(options, text);
  const Parsed graph = parse(text.str());
  double translation = 0, rotation = 0;
  SE3 chain = graph.truth[0];
  for (const auto& [i, step] : graph.odometry) {
    const std::size_t k = static_cast<std::size_t>(i);
    EXPECT_LT((chain.translation() - graph.init[k].translation()).norm(), 1e-6);
    chain = chain * step;
    const Vector6d error = ((graph.truth[k].inverse() * graph.truth[k + 1]).inverse() * step).log();
    translation += error.head<3>().squaredNorm() / 3 / (0.01 * 0.01);
    rotation += error.tail<3>().squaredNorm() / 3 / (0.002 * 0.002);
  }
  const double n = static_cast<double>(graph.odometry.size());
  EXPECT_NEAR(translation / n, 1, 0.1);
  EXPECT_NEAR(rotation / n, 1, 0.1);
}

TEST(PlaneGraphSim, SharedFloorIsOnePlaneAStorey) {
  PlaneGraphOptions options;
  options.shared_floor = true;
  std::ostringstream text;
  const PlaneGraphCounts counts = write_plane_graph(options, text);
  EXPECT_EQ(counts.poses, 2000);
  EXPECT_EQ(counts.planes, 302);
  const Parsed graph = parse(text.str());
  std::map<std::size_t, int> seen;
  for (const auto& o : graph.observations) ++seen[o.plane];
  EXPECT_GT(seen[0], 400);
}

TEST(PlaneGraphSim, SizesAndErrors) {
  for (std::int64_t wanted : {40, 2000, 20000, 100000}) {
    const double got = static_cast<double>(PlaneGraphOptions::of_size(wanted).poses());
    EXPECT_NEAR(got / static_cast<double>(wanted), 1, 0.05) << wanted;
  }
  PlaneGraphOptions bad;
  bad.points = 2;
  std::ostringstream text;
  EXPECT_THROW(write_plane_graph(bad, text), Error);
}

}  // namespace
}  // namespace lamina::sim
