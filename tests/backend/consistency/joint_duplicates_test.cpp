// Where a lap ends at its beginning: walls of a corridor, each seen at either end of the way.
#include <lamina/backend/consistency/joint_duplicates.hpp>

#include <gtest/gtest.h>

#include <cmath>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

// A corridor along x that two keyframes see, the later one by a path that drifted.
struct LapEnd {
  Graph graph;
  std::map<PlaneId, std::vector<OutlinePiece>> outlines;
  DoubleOptions options;
  KeyframeId begin, end;
  SE3 T_map_end;  // where it is; the graph has it where the path says

  explicit LapEnd(double aside = 0.08, double turned = 0.5 * kDegree) {
    T_map_end = SE3::planar(-4, 0, 0);
    begin = graph.add_keyframe(Timestamp::from_seconds(0), SE3());
    end =
        graph.add_keyframe(Timestamp::from_seconds(60), T_map_end * SE3::planar(0, aside, turned));
    graph.at(begin).fixed = true;
    Vector6d sigma;
    sigma << 0.15, 0.15, 0.002, 0.001, 0.001, 0.8 * kDegree;
    graph.odometry.push_back(
        {begin, end, graph.at(end).T_map_body, Matrix6d(sigma.cwiseInverse().asDiagonal())});
  }
  // A wall at y that faces the middle, from x0 to x1, as `keyframe` saw it.
  PlaneId see(KeyframeId keyframe, double y, double x0, double x1) {
    const SE3 T_map_body = keyframe == end ? T_map_end : SE3();
    const SE3 T_body_map = T_map_body.inverse();
    const Plane wall({0, y > 0 ? -1.0 : 1.0, 0}, -std::abs(y));
    Moments m;
    for (double x = x0; x <= x1; x += 0.1) {
      for (double z = 0; z <= 1; z += 0.1) m.add(T_body_map * Eigen::Vector3d(x, y, z), 1e4);
    }
    const SE3 T_graph = graph.at(keyframe).T_map_body;
    const PlaneId id =
        graph.add_plane(PlaneLandmark::at(T_graph * T_body_map * wall, T_graph * m.mean()));
    const NoiseFloor floor{options.association.surface_sigma_m,
                           options.association.surface_sigma_deg * kDegree, 0};
    graph.plane_moments.push_back(
        {keyframe, id, m.discounted((T_body_map * wall).normal(), floor)});
    OutlinePiece piece{keyframe, {}};
    for (const auto& [x, z] : {std::pair(x0, 0.0), {x1, 0.0}, {x1, 1.0}, {x0, 1.0}})
      piece.points_body.push_back(T_body_map * Eigen::Vector3d(x, y, z));
    outlines[id].push_back(piece);
    remake_outline(graph.at(id), outlines[id], graph, 0.1);
    return id;
  }
  std::size_t found() const { return find_joint_duplicates(graph, outlines, {}, options).size(); }
  std::size_t found_alone() const { return find_doubles(graph, outlines, {}, options).size(); }
};

TEST(WaitingDoubles, BothSidesOfACorridorTellTheEndOfALap) {
  LapEnd lap;
  lap.see(lap.begin, 1.1, 0, 4);
  lap.see(lap.begin, -1.1, 0, 4);
  lap.see(lap.end, 1.1, -3.5, 1);
  lap.see(lap.end, -1.1, -3.5, 1);
  EXPECT_EQ(lap.found_alone(), 0U);
  EXPECT_EQ(lap.found(), 2U);
}

TEST(WaitingDoubles, OneSideTellsNothing) {
  LapEnd lap;
  lap.see(lap.begin, 1.1, 0, 4);
  lap.see(lap.end, 1.1, -3.5, 1);
  lap.see(lap.end, -1.1, -3.5, 1);
  EXPECT_EQ(lap.found(), 0U);
}

TEST(WaitingDoubles, NorDoesACorridorOfAnotherWidth) {
  LapEnd lap;
  lap.see(lap.begin, 1.1, 0, 4);
  lap.see(lap.begin, -1.1, 0, 4);
  lap.see(lap.end, 1.1, -3.5, 1);
  lap.see(lap.end, -1.25, -3.5, 1);
  EXPECT_EQ(lap.found(), 0U);
}

// A slab of 5 cm before the wall: either could be what the lap's end shows.
TEST(WaitingDoubles, WallsThatTwoOthersFitWait) {
  LapEnd lap;
  lap.see(lap.begin, 1.1, 0, 4);
  lap.see(lap.begin, 1.05, 0, 4);
  lap.see(lap.begin, -1.1, 0, 4);
  lap.see(lap.begin, -1.15, 0, 4);
  lap.see(lap.end, 1.1, -3.5, 1);
  lap.see(lap.end, -1.1, -3.5, 1);
  EXPECT_EQ(lap.found(), 0U);
}

TEST(WaitingDoubles, WhatWasToldApartStaysApart) {
  LapEnd lap;
  const PlaneId left = lap.see(lap.begin, 1.1, 0, 4);
  lap.see(lap.begin, -1.1, 0, 4);
  const PlaneId again = lap.see(lap.end, 1.1, -3.5, 1);
  lap.see(lap.end, -1.1, -3.5, 1);
  EXPECT_TRUE(find_joint_duplicates(lap.graph, lap.outlines, {{left, again}}, lap.options).empty());
}

}  // namespace
}  // namespace lamina
