// Planes that turn out to be one when the whole graph is refined.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "backend/mapper/mapper_room.hpp"

namespace lamina {
namespace {

using namespace made_up;  // NOLINT

// Of all seeds some doubles are left: `laps_bench doubles`.
void expect_all_merged(const std::vector<unsigned>& seeds, int at_least) {
  Doubles doubles;
  for (const unsigned seed : seeds) {
    Mapper mapper = doubled(seed, make_room_with_slab());
    doubles.refine(mapper);
    EXPECT_TRUE(mapper.graph().problems().empty());
  }
  ASSERT_GT(doubles.before, at_least);
  EXPECT_EQ(doubles.strange, 0);
  EXPECT_EQ(doubles.wrong, 0);
  EXPECT_EQ(doubles.left, 0) << doubles.before << " doubles";
}

TEST(MapperMerge, ReSightingsOverTwoLapsBecomeOneAndNothingElseDoes) {
  expect_all_merged({1, 2, 3, 4, 7}, 5);
}

TEST(MapperMerge, ALapThatWrongNamesHoldAsideComesBack) { expect_all_merged({13, 16, 22}, 5); }

// What an image shows of a floor and of platforms on it: each panel whole, its tilt off by what an
// image shares, its height by half a millimetre.
Observations see_platforms(Sensor& sensor, const SE3& T_map_body, Timestamp stamp,
                           const std::vector<Panel>& panels) {
  Observations o = sensor.depth(T_map_body, stamp, panels);
  for (std::size_t i = 0; i < o.planes.size(); ++i) {
    PlaneObservation& p = o.planes[i];
    p.kind = i == 0 ? PlaneKind::kDominantFloor : PlaneKind::kSubDominant;
    p.floor = {0.0005, i == 0 ? 0.001 : 0.003};
    const Eigen::Vector3d c = p.moments_sensor.mean();
    const SE3 off =
        SE3::from_translation(c) *
        SE3(SO3::exp({i == 0 ? 0 : sensor.gauss(0.003), i == 0 ? 0 : sensor.gauss(0.003), 0}),
            {0, 0, sensor.gauss(0.0005)}) *
        SE3::from_translation(-c);
    p.moments_sensor = p.moments_sensor.transformed(off);
    p.plane_sensor = off * p.plane_sensor;
    for (auto& x : p.outline_sensor) x = off * x;
  }
  return o;
}

// Heights of the level planes of a map after a drive past platforms of these heights, 1.2 m wide,
// left and right of the way, ascending.
std::vector<double> heights_found(const std::vector<double>& platforms, unsigned seed) {
  std::vector<Panel> panels{{Plane({0, 0, 1}, 0), {4, 0, 0}, {5, 2.5}}};
  for (std::size_t i = 0; i < platforms.size(); ++i) {
    panels.push_back({Plane({0, 0, 1}, platforms[i]),
                      {3 + 2.2 * static_cast<double>(i / 2), i % 2 == 0 ? 1.2 : -1.2, platforms[i]},
                      {0.6, 0.6}});
  }
  Sensor sensor(seed);
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << 1e-5, 1e-5, 1e-8, 1e-8, 1e-8, 1e-6;
  Mapper mapper;
  for (std::size_t i = 0; i < 25; ++i) {
    const SE3 T_map_body = SE3::planar(0.08 * static_cast<double>(i), 0, 0);
    mapper.add(see_platforms(sensor, T_map_body, at_frame(i), panels),
               i == 0 ? SE3() : SE3::planar(0.08, 0, 0), covariance);
  }
  mapper.refine();
  std::vector<double> heights;
  for (const MapPlane& plane : mapper.map().planes) heights.push_back(plane.centroid_map.z());
  std::sort(heights.begin(), heights.end());
  return heights;
}

TEST(MapperMerge, PlatformsWithFloorBetweenStayTwo) {
  const std::array<double, 5> heights{0, 0.02, 0.03, 0.05, 0.1};
  const auto found = heights_found({0.02, 0.03, 0.05, 0.1}, 1);
  ASSERT_EQ(found.size(), heights.size());
  for (std::size_t i = 0; i < heights.size(); ++i) EXPECT_NEAR(found[i], heights[i], 0.004);
}

// Faces of pillars half a metre wide and high with 1.5 m between them, each 3 cm further back.
std::vector<Panel> slanting_row() {
  std::vector<Panel> panels;
  for (int k = 0; k < 3; ++k) {
    const double y = 1.2 + 0.03 * k;
    panels.push_back({Plane({0, -1, 0}, -y), {2.5 + 2.0 * k, y, 0.5}, {0.25, 0.25}});
  }
  return panels;
}

// y of the upright planes after a drive along x, ascending.
template <class See>
std::vector<double> rows_found(See see) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << 1e-5, 1e-5, 1e-8, 1e-8, 1e-8, 1e-6;
  Mapper mapper;
  for (std::size_t i = 0; i < 40; ++i) {
    const SE3 T_map_body = SE3::planar(0.12 * static_cast<double>(i), 0, 0);
    mapper.add(see(T_map_body, at_frame(i)), i == 0 ? SE3() : SE3::planar(0.12, 0, 0), covariance);
  }
  mapper.refine();
  std::vector<double> rows;
  for (const MapPlane& plane : mapper.map().planes) {
    if (std::abs(plane.plane_map.normal().y()) > 0.5) rows.push_back(plane.centroid_map.y());
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

void expect_slanting_row(const std::vector<double>& rows, unsigned seed) {
  ASSERT_EQ(rows.size(), 3u) << seed;
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(rows[k], 1.2 + 0.03 * static_cast<double>(k), 0.01) << seed;
}

// As views of a few pixels tell them: turned and shifted as one each time.
TEST(MapperMerge, FacesOfPillarsInASlantingRowStayApart) {
  auto panels = slanting_row();
  panels.push_back({Plane({0, 0, 1}, 0), {4, 0, 0}, {8, 0.8}});
  for (const unsigned seed : {1U, 2U}) {
    Sensor sensor(seed);
    const auto see = [&](const SE3& T_map_body, Timestamp stamp) {
      Observations o = sensor.depth(T_map_body, stamp, panels);
      for (PlaneObservation& p : o.planes) {
        if (p.kind == PlaneKind::kDominantFloor) continue;
        p.floor = {0.004, 0.02};
        const Eigen::Vector3d c = p.moments_sensor.mean();
        const SE3 off = SE3::from_translation(c) *
                        SE3(SO3::exp({0, 0, sensor.gauss(0.01)}), {0, sensor.gauss(0.002), 0}) *
                        SE3::from_translation(-c);
        p.moments_sensor = p.moments_sensor.transformed(off);
        p.plane_sensor = off * p.plane_sensor;
        for (auto& x : p.outline_sensor) x = off * x;
      }
      return o;
    };
    expect_slanting_row(rows_found(see), seed);
  }
}

TEST(MapperMerge, LinesOfPillarsInASlantingRowStayApart) {
  const auto panels = slanting_row();
  for (const unsigned seed : {1U, 2U}) {
    Sensor sensor(seed);
    const auto see = [&](const SE3& T_map_body, Timestamp stamp) {
      std::vector<Panel> ahead;  // as far as they are not hidden
      for (const Panel& panel : panels) {
        const double x = panel.middle.x() - T_map_body.translation().x();
        if (x > -2.5 && x < 2.5) ahead.push_back(panel);
      }
      return sensor.scan(T_map_body, stamp, ahead);
    };
    expect_slanting_row(rows_found(see), seed);
  }
}

TEST(MapperMerge, ALowPlatformOfFewViewsStaysApartFromItsFloor) {
  const auto found = heights_found({0.02}, 4);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[1] - found[0], 0.02, 0.004);
}

TEST(MapperMerge, AMergeIsTakenBackWithItsEvidence) {
  Mapper mapper = doubled(4, make_room());
  mapper.refine();
  const std::size_t merged = mapper.map().planes.size();
  PlaneId from = PlaneId::kNone;
  std::size_t factors = 0;
  for (const auto& plane : mapper.graph().planes) {
    if (!plane.active && plane.merged_into != PlaneId::kNone) from = plane.id;
  }
  ASSERT_NE(from, PlaneId::kNone);
  ASSERT_TRUE(mapper.undo_merge(from));
  EXPECT_EQ(mapper.map().planes.size(), merged + 1);
  for (const auto& f : mapper.graph().plane_moments) factors += f.plane == from ? 1 : 0;
  EXPECT_GE(factors, 1u);
  EXPECT_FALSE(mapper.undo_merge(from));
  EXPECT_TRUE(mapper.graph().problems().empty());
}

TEST(MapperMerge, WhatStoodThroughTwoRefinementsStays) {
  Mapper mapper = doubled(4, make_room());
  mapper.refine();
  std::vector<PlaneId> merged;
  for (const auto& plane : mapper.graph().planes) {
    if (!plane.active && plane.merged_into != PlaneId::kNone) merged.push_back(plane.id);
  }
  ASSERT_FALSE(merged.empty());
  mapper.refine();
  for (const PlaneId id : merged) EXPECT_FALSE(mapper.undo_merge(id));
}

// Undoing, as refinement does, gives views of the present keyframe to other planes: the next frame
// of that keyframe finds none of its plane.
TEST(MapperMerge, FramesGoOnAfterTheKeyframesViewsWentToAnotherPlane) {
  constexpr unsigned kSeed = 2;
  const auto room = make_room();
  Mapper mapper = doubled(kSeed, room);
  mapper.refine();
  std::vector<PlaneId> merged;
  for (const auto& plane : mapper.graph().planes) {
    if (!plane.active && plane.merged_into != PlaneId::kNone) merged.push_back(plane.id);
  }
  const KeyframeId keyframe = mapper.graph().keyframes.back().id;
  bool of_this_keyframe = false;
  for (const PlaneId from : merged) {
    mapper.undo_merge(from);
    for (const auto& f : mapper.graph().plane_moments) {
      of_this_keyframe = of_this_keyframe || (f.keyframe == keyframe && f.plane == from);
    }
  }
  ASSERT_TRUE(of_this_keyframe);
  Sensor sensor(7);
  const SE3 here = Drive(360, 180, kSeed).truth.back();
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NO_THROW(mapper.add(sensor.depth(here, at_frame(400 + i), room), SE3(),
                               1e-8 * Matrix6d::Identity()));
  }
  EXPECT_TRUE(mapper.graph().problems().empty());
}

}  // namespace
}  // namespace lamina
