// graph.g2o: what other tools read of it says what the graph says.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include <lamina/io/graph_files.hpp>

namespace lamina::io {
namespace {

// An edge between a pose and a plane, as it stands in the file.
struct PlaneEdge {
  std::int64_t keyframe = 0, plane = 0, offset = 0;
  Eigen::Vector4d measurement;
  Eigen::Matrix3d information;
};

struct G2o {
  std::map<std::int64_t, SE3> poses;
  std::map<std::int64_t, Eigen::Vector4d> planes;
  std::set<std::int64_t> fixed;
  std::vector<PlaneEdge> edges;
};

template <int N>
Eigen::Matrix<double, N, 1> numbers(std::istream& in) {
  Eigen::Matrix<double, N, 1> v;
  for (int i = 0; i < N; ++i) in >> v(i);
  EXPECT_TRUE(in);
  return v;
}

G2o read(const std::filesystem::path& file) {
  G2o result;
  std::ifstream in(file);
  for (std::string line, tag; std::getline(in, line);) {
    std::istringstream text(line);
    std::int64_t id = 0;
    text >> tag >> id;
    if (tag == "FIX") {
      EXPECT_TRUE(result.poses.count(id) + result.planes.count(id)) << "held before it is there";
      result.fixed.insert(id);
    } else if (tag == "VERTEX_SE3:QUAT") {
      const auto v = numbers<7>(text);
      const Eigen::Quaterniond q(v(6), v(3), v(4), v(5));
      result.poses[id] = SE3(SO3(q.normalized()), v.head<3>());
    } else if (tag == "VERTEX_PLANE") {
      result.planes[id] = numbers<7>(text).head<4>();  // and a colour
    } else if (tag == "EDGE_SE3_PLANE_CALIB") {
      PlaneEdge edge;
      edge.keyframe = id;
      text >> edge.plane >> edge.offset;
      edge.measurement = numbers<7>(text).head<4>();  // and a colour
      const auto u = numbers<6>(text);
      edge.information << u(0), u(1), u(2), u(1), u(3), u(4), u(2), u(4), u(5);
      result.edges.push_back(edge);
    }
  }
  return result;
}

// g2o's error, from its formulas: the measured normal's azimuth and elevation in a frame whose x is
// the estimated one's, and estimated less measured distance.
Eigen::Vector3d error(const Eigen::Vector4d& estimate, const Eigen::Vector4d& measurement) {
  const Eigen::Vector3d n = estimate.head<3>();
  const double azimuth = std::atan2(n.y(), n.x()),
               elevation = std::atan2(n.z(), n.head<2>().norm());
  const Eigen::Matrix3d R = (Eigen::AngleAxisd(azimuth, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(-elevation, Eigen::Vector3d::UnitY()))
                                .toRotationMatrix();
  const Eigen::Vector3d m = R.transpose() * measurement.head<3>();
  return {std::atan2(m.y(), m.x()), std::atan2(m.z(), m.head<2>().norm()),
          measurement(3) - estimate(3)};
}

double chi_squared(const G2o& graph, const PlaneEdge& edge) {
  const SE3 T_sensor_map = (graph.poses.at(edge.keyframe) * graph.poses.at(edge.offset)).inverse();
  const Eigen::Vector4d& map = graph.planes.at(edge.plane);
  const Plane local = T_sensor_map * Plane(map.head<3>(), -map(3));
  Eigen::Vector4d estimate;
  estimate << local.normal(), -local.rho();
  const Eigen::Vector3d e = error(estimate, edge.measurement);
  return e.dot(edge.information * e);
}

// Three poses that see a leaning wall and a floor in full, with 5 mm of noise, and lines of another
// wall.
class GraphFiles : public testing::Test {
 protected:
  void SetUp() override {
    for (int k = 0; k < 3; ++k) {
      graph_.add_keyframe(Timestamp::from_seconds(k),
                          SE3(SO3::exp({0.02, -0.05, 0.3 * k}), {0.5 * k, 0.1, 0.4}));
    }
    graph_.keyframes.front().fixed = true;
    const Eigen::Vector3d normal = Eigen::Vector3d(-1, 0.3, 0.2).normalized();
    wall_ = graph_.add_plane(PlaneLandmark::at(Plane(normal, -4), {4, 0, 1}));
    floor_ = graph_.add_plane(PlaneLandmark::at(Plane({0, 0, 1}, 0), {3, 1, 0}));
    line_ = graph_.add_plane(PlaneLandmark::at(Plane({0, -1, 0}, -2), {0, 2, 0}));
    for (const Keyframe& k : graph_.keyframes) {
      see(k, wall_, 0.8, {1.0, 0.3});
      see(k, floor_, 0.6, {0.8, 0.5});
      see(k, line_, 1.0, {1.5, 0.0});
    }
    graph_.plane_moments.front().weight = 0.5;
  }
  void TearDown() override { std::filesystem::remove(file_); }

  // Points about the anchor, `half` m along the plane's axes; none across for a scanner's line.
  void see(const Keyframe& k, PlaneId id, double off, const Eigen::Vector2d& half) {
    const PlaneLandmark& landmark = graph_.at(id);
    const Matrix32d B = landmark.plane_anchor.tangent_basis();
    std::normal_distribution<double> noise(0, 0.005);
    Moments moments;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector2d uv((i % 20) / 9.5 - 1, (i / 20) / 9.5 - 1);  // NOLINT
      const Eigen::Vector3d x = landmark.anchor_map + B * (half.cwiseProduct(uv)) + off * B.col(0) +
                                noise(rng_) * landmark.plane_anchor.normal();
      moments.add(k.T_map_body.inverse() * x, 1 / 2.5e-5);
    }
    const Plane local = k.T_map_body.inverse() * landmark.plane_map();
    graph_.plane_moments.push_back(
        {k.id, id, moments.discounted(local.normal(), {0.002, 0.001}), ExtrinsicsId::kNone, 1.0});
  }

  std::mt19937 rng_{3};
  Graph graph_;
  PlaneId wall_{}, floor_{}, line_{};
  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() /
      (std::string("lamina_g2o_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(GraphFiles, FullViewsOfPlanesAreEdgesThatFitTheEstimate) {
  write_g2o(file_, graph_);
  const G2o read_back = read(file_);
  EXPECT_EQ(read_back.poses.size(), 4u);  // and the sensor's place
  EXPECT_EQ(read_back.planes.size(), 3u);
  ASSERT_EQ(read_back.edges.size(), 6u);
  double sum = 0;
  for (const PlaneEdge& edge : read_back.edges) {
    ASSERT_TRUE(read_back.poses.count(edge.keyframe) && read_back.planes.count(edge.plane) &&
                read_back.poses.count(edge.offset));
    EXPECT_TRUE(read_back.fixed.count(edge.offset));
    EXPECT_LT(read_back.poses.at(edge.offset).log().norm(), 1e-12);
    EXPECT_GT(edge.information.determinant(), 0);
    EXPECT_LT(chi_squared(read_back, edge), 16.3);  // 3 degrees, 99.9 %
    sum += chi_squared(read_back, edge);
  }
  EXPECT_GT(sum, 0);
  // What no view defines is there to be drawn, and held.
  const std::int64_t line = graph_.next_keyframe + static_cast<std::int64_t>(line_);
  EXPECT_TRUE(read_back.planes.count(line) && read_back.fixed.count(line));
  for (const PlaneEdge& edge : read_back.edges) EXPECT_NE(edge.plane, line);
}

// Wherever the wall is moved to, an edge costs what the graph's own factor does.
TEST_F(GraphFiles, EdgesCostWhatTheFactorsCost) {
  write_g2o(file_, graph_);
  G2o read_back = read(file_);
  const Plane wall = graph_.at(wall_).plane_map();
  for (const Eigen::Vector3d& d :
       {Eigen::Vector3d(0.02, 0, 0), Eigen::Vector3d(0, 0.02, 0), Eigen::Vector3d(0, 0, 0.05),
        Eigen::Vector3d(0.01, -0.02, 0.04)}) {
    const Plane moved = wall.boxplus(d);
    read_back.planes.begin()->second << moved.normal(), -moved.rho();
    for (std::size_t i = 0; i < read_back.edges.size(); ++i) {
      const PlaneEdge& edge = read_back.edges[i];
      if (edge.plane != read_back.planes.begin()->first) continue;
      const auto& f = graph_.plane_moments[3 * (i / 2)];
      ASSERT_EQ(static_cast<std::int64_t>(f.keyframe), edge.keyframe);
      const Plane local = graph_.at(f.keyframe).T_map_body.inverse() * moved;
      const double own = f.weight * f.moments_body.cost(local);
      EXPECT_NEAR(chi_squared(read_back, edge), own, 0.06 * own) << d.transpose();
    }
  }
}

// A floor lies at the pole of azimuths: its edges claim no more than the factors, whichever way it
// tilts.
TEST_F(GraphFiles, EdgesOfFloorsClaimNoMoreThanTheFactors) {
  write_g2o(file_, graph_);
  G2o read_back = read(file_);
  const Plane floor = graph_.at(floor_).plane_map();
  const std::int64_t id = graph_.next_keyframe + static_cast<std::int64_t>(floor_);
  for (int k = 0; k < 8; ++k) {
    const Plane moved = floor.boxplus({0.05 * std::cos(k), 0.05 * std::sin(k), 0.1 * (k % 3 - 1)});
    read_back.planes.at(id) << moved.normal(), -moved.rho();
    for (std::size_t i = 0; i < read_back.edges.size(); ++i) {
      if (read_back.edges[i].plane != id) continue;
      const auto& f = graph_.plane_moments[3 * (i / 2) + 1];
      const Plane local = graph_.at(f.keyframe).T_map_body.inverse() * moved;
      const double claimed = chi_squared(read_back, read_back.edges[i]);
      EXPECT_LT(claimed, 1.2 * f.moments_body.cost(local) + 1);
      EXPECT_GT(claimed, 1);
    }
  }
}

}  // namespace
}  // namespace lamina::io
