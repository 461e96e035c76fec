// Maps at rest: joined without a change to what they say, found in each other, refused when alike.
#include <lamina/backend/mapper/map_state.hpp>

#include <gtest/gtest.h>

#include <lamina/backend/association/outline_split.hpp>
#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/backend/merging/map_alignment.hpp>
#include <lamina/backend/merging/place_search.hpp>

namespace lamina {
namespace {

// A rectangle of surface: plane, middle, and half extents along an axis of it and across.
struct Panel {
  Plane plane;
  Eigen::Vector3d middle, along;
  double half_along, half_across;
};

Panel wall(double nx, double ny, double x, double y, double half) {
  const Eigen::Vector3d n(nx, ny, 0), m(x, y, 1.25);
  return {Plane(n, n.dot(m)), m, n.cross(Eigen::Vector3d::UnitZ()), half, 1.25};
}

// An L-shaped flat: no turn lays it upon itself.
std::vector<Panel> flat() {
  return {{Plane({0, 0, 1}, 0), {4, 1, 0}, {1, 0, 0}, 4, 3},
          wall(1, 0, 0, 1, 3),
          wall(0, 1, 4, -2, 4),
          wall(-1, 0, 8, -0.5, 1.5),
          wall(0, -1, 5.5, 1, 2.5),
          wall(-1, 0, 3, 2.5, 1.5),
          wall(0, -1, 1.5, 4, 1.5)};
}

std::vector<Panel> square_room() {
  return {{Plane({0, 0, 1}, 0), {0, 0, 0}, {1, 0, 0}, 3, 3},
          wall(1, 0, -3, 0, 3),
          wall(-1, 0, 3, 0, 3),
          wall(0, 1, 0, -3, 3),
          wall(0, -1, 0, 3, 3)};
}

// The flat with columns in it, their four sides half a metre wide.
std::vector<Panel> furnished() {
  std::vector<Panel> panels = flat();
  for (const auto& [x, y] : {std::pair{1.5, 0.3}, {4.2, -0.9}, {6.6, -0.2}}) {
    panels.push_back(wall(1, 0, x + 0.25, y, 0.25));
    panels.push_back(wall(-1, 0, x - 0.25, y, 0.25));
    panels.push_back(wall(0, 1, x, y + 0.25, 0.25));
    panels.push_back(wall(0, -1, x, y - 0.25, 0.25));
  }
  return panels;
}

// As `panels`, seen by a level scanner alone: no floor, lines for walls.
MapState lines_of(MapState map) {
  for (PlaneLandmark& plane : map.graph.planes) {
    if (std::abs(plane.plane_map().normal().z()) > 0.9) plane.active = false;
    map.partial.insert(plane.id);
  }
  return map;
}

// What a survey from a few places gives: exact moments, odometry between, outlines. `T_map_world`:
// where its map frame is.
MapState survey(const std::vector<Panel>& panels, const SE3& T_map_world) {
  MapState map;
  map.surfels = SurfelEvidence(0.1);
  Graph& g = map.graph;
  for (int k = 0; k < 4; ++k) {
    const SE3 T_world_body = SE3::planar(1 + 0.4 * k, -0.5 + 0.1 * k, 0.3 * k);
    const auto stamp = Timestamp::from_seconds(100 + k);
    const KeyframeId id = g.add_keyframe(stamp, T_map_world * T_world_body);
    map.frames.push_back({stamp, id, SE3()});
    map.loose_body[id] = {{1, 0, 0.3}};
    if (k == 0) g.keyframes.back().fixed = true;
    if (k == 0) continue;
    const KeyframeId before = g.keyframes[g.keyframes.size() - 2].id;
    const SE3 T = g.at(before).T_map_body.inverse() * g.at(id).T_map_body;
    g.odometry.push_back({before, id, T, 50 * Matrix6d::Identity()});
  }
  for (const Panel& p : panels) {
    PlaneLandmark landmark = PlaneLandmark::at(T_map_world * p.plane, T_map_world * p.middle);
    landmark.outline = OutlineGrid(0.1);
    landmark.covariance = Eigen::Vector3d(1e-4, 4e-4, 1e-4).asDiagonal();
    const PlaneId id = g.add_plane(landmark);
    const Eigen::Vector3d across = p.plane.normal().cross(p.along);
    for (const Keyframe& k : g.keyframes) {
      const SE3 T_body_world = k.T_map_body.inverse() * T_map_world;
      OutlinePiece piece{k.id, {}};
      Moments moments;
      for (const auto& [u, v] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        const Eigen::Vector3d x =
            p.middle + u * p.half_along * p.along + v * p.half_across * across;
        piece.points_body.push_back(T_body_world * x);
        moments.add(T_body_world * x, 1e4);
      }
      std::vector<Eigen::Vector3d> points_map;
      for (const auto& x : piece.points_body) points_map.push_back(k.T_map_body * x);
      grow_outline(g.at(id), points_map);
      map.outlines[id].push_back(piece);
      g.plane_moments.push_back({k.id, id, moments, ExtrinsicsId::kNone, 1.0});
    }
    MarginalPrior prior;
    prior.planes = {id};
    prior.planes_linear = {g.at(id).plane_anchor.boxplus({0.02, -0.01, 0.03})};
    prior.sqrt_information = Eigen::Vector3d(3, 7, 1).asDiagonal();
    prior.residual = Eigen::Vector3d::Zero();
    g.marginal_priors.push_back(prior);
  }
  return map;
}

const SE3 kElsewhere(SO3::rot_z(2.2) * SO3::rot_x(0.01), {12, -5, 0.4});

double cost_before(const MapState& map) {
  Graph graph = map.graph;
  double sum = 0;
  for (const CostChange& c : refine(graph).costs) sum += c.before;
  return sum;
}

TEST(MapOverlap, FindsAFlatInItself) {
  const MapState a = survey(furnished(), SE3()), b = survey(furnished(), kElsewhere);
  const OverlapResult found = find_overlap(a, b);
  ASSERT_TRUE(found.overlap) << found.reason;
  const SE3 off = found.overlap->T_a_b * kElsewhere;
  EXPECT_LT(off.translation().norm(), 0.01);
  EXPECT_LT(off.so3().log().norm(), 0.005);
  EXPECT_EQ(found.overlap->planes.size(), furnished().size());
  EXPECT_TRUE(found.overlap->level);
  for (const auto& [of_b, of_a] : found.overlap->planes) EXPECT_EQ(of_b, of_a);
}

TEST(MapOverlap, RefusesPlacesThatLookAlike) {
  const OverlapResult found =
      find_overlap(survey(square_room(), SE3()), survey(square_room(), kElsewhere));
  EXPECT_FALSE(found.overlap);
  EXPECT_NE(found.reason.find("needed"), std::string::npos) << found.reason;
}

// Walls alone, as a level scanner sees them: place and heading, height and tilt left as they are.
TEST(MapOverlap, LinesOfScansAreEnough) {
  const SE3 turned(SO3::rot_z(2.2), {12, -5, 0});
  const MapState a = lines_of(survey(furnished(), SE3()));
  const MapState b = lines_of(survey(furnished(), turned));
  const OverlapResult found = find_overlap(a, b);
  ASSERT_TRUE(found.overlap) << found.reason;
  EXPECT_FALSE(found.overlap->level);
  EXPECT_LT((found.overlap->T_a_b * turned).log().norm(), 0.02);
  EXPECT_NEAR(found.overlap->T_a_b.translation().z(), 0, 1e-9);
  MapState both = a;
  append(both, b, *found.overlap);
  ASSERT_EQ(both.graph.priors.size(), 1u);
  const Matrix6d S = both.graph.priors[0].sqrt_information;
  EXPECT_EQ(S(0, 0), 0);
  EXPECT_EQ(S(1, 1), 0);
}

// Two of three equal rooms each: either room of the one may be either of the other.
TEST(MapOverlap, RefusesRoomsThatRepeat) {
  const auto rooms = [](int first, int last) {
    std::vector<Panel> all{furnished()[0]};
    for (int room = first; room <= last; ++room) {
      auto panels = furnished();
      for (std::size_t i = 1; i < panels.size(); ++i) {
        panels[i].middle.x() += 10 * room;
        panels[i].plane =
            Plane(panels[i].plane.normal(), panels[i].plane.normal().dot(panels[i].middle));
        all.push_back(panels[i]);
      }
    }
    return all;
  };
  const OverlapResult found =
      find_overlap(survey(rooms(0, 1), SE3()), survey(rooms(1, 2), kElsewhere));
  EXPECT_FALSE(found.overlap);
  EXPECT_NE(found.reason.find("epeat"), std::string::npos) << found.reason;
}

TEST(MapOverlap, RaysThroughAWallSpeakAgainstIt) {
  const MapState map = survey(flat(), SE3());
  FreeSpace free;
  for (int k = 0; k < 200; ++k) {  // across the wall x = 8, y -1.9 to 0.1, a metre and more beyond
    const double y = -1.9 + 0.01 * k;
    for (int n = 0; n < 3; ++n) free.add_ray({6, y, 0.5}, {11, y, 0.5});
  }
  EXPECT_TRUE(free.free({8, -1}));
  EXPECT_FALSE(free.free({8, 3}));
  EXPECT_FALSE(free.free({11, -1}));
  const FreeSpace none;
  const MapState wall_gone = survey({flat()[0], flat()[1], flat()[2]}, SE3());
  const PlanWalls with(map, none), without(wall_gone, none), seen_through(wall_gone, free);
  const PlaceEvidence before = weigh_place(without, with, PlanPose());
  const PlaceEvidence after = weigh_place(seen_through, with, PlanPose());
  EXPECT_EQ(before.through_m, 0);
  EXPECT_NEAR(after.through_m, 2, 0.4);
  EXPECT_LT(after.nats, before.nats - 6);
}

TEST(MapOverlap, AlikePlacesInOneFrameKeepIt) {
  std::vector<Panel> panels = square_room();  // columns by quarter turns
  for (const auto& [x, y] : {std::pair{2.0, 1.0}, {-1.0, 2.0}, {-2.0, -1.0}, {1.0, -2.0}}) {
    panels.push_back(wall(1, 0, x + 0.25, y, 0.25));
    panels.push_back(wall(-1, 0, x - 0.25, y, 0.25));
    panels.push_back(wall(0, 1, x, y + 0.25, 0.25));
    panels.push_back(wall(0, -1, x, y - 0.25, 0.25));
  }
  const SE3 drift(SO3::rot_z(0.03), {0.1, 0.05, 0});
  const OverlapResult found = find_overlap(survey(panels, SE3()), survey(panels, drift));
  ASSERT_TRUE(found.overlap) << found.reason;
  EXPECT_LT((found.overlap->T_a_b * drift).log().norm(), 0.01);
  EXPECT_TRUE(found.kept_frame);
  const OverlapResult moved = find_overlap(survey(panels, SE3()), survey(panels, kElsewhere));
  EXPECT_FALSE(moved.overlap);
}

TEST(MapOverlap, RefusesMapsThatShareTooLittle) {
  const auto panels = flat();
  const MapState a = survey({panels[0], panels[1], panels[2]}, SE3());
  const OverlapResult found = find_overlap(a, survey(flat(), kElsewhere));
  EXPECT_FALSE(found.overlap);
  EXPECT_FALSE(found.reason.empty());
}

TEST(MapState, AppendedMapSaysWhatItSaid) {
  MapState a = survey(flat(), SE3());
  const MapState b = survey(flat(), kElsewhere);
  const double alone = cost_before(a), moved = cost_before(b);
  append(a, b, {kElsewhere.inverse(), {}});
  EXPECT_TRUE(a.problems().empty()) << a.problems().front();
  EXPECT_NEAR(cost_before(a), alone + moved, 1e-6 * (alone + moved));
  EXPECT_EQ(a.frames.size(), 8u);
  EXPECT_EQ(a.loose_body.size(), 8u);
}

TEST(MapState, DoubtsThatAreNoCovariancesAreProblems) {
  MapState a = survey(flat(), SE3());
  ASSERT_TRUE(a.problems().empty());
  a.extrinsics_covariance(1, 1) = std::nan("");
  a.wheel_covariance(0, 0) = -1;
  ASSERT_EQ(a.problems().size(), 2u);
  EXPECT_NE(a.problems()[0].find("mountings"), std::string::npos);
  EXPECT_NE(a.problems()[1].find("wheels"), std::string::npos);
}

TEST(MapState, JoinedMapHasEveryPlaneOnce) {
  MapState a = survey(flat(), SE3());
  const MapState b = survey(flat(), kElsewhere);
  // Off by some centimetres: refinement pulls the two together.
  MapOverlap overlap{SE3(SO3::rot_z(0.01), {0.05, -0.04, 0.02}) * kElsewhere.inverse(), {}};
  for (const auto& plane : b.graph.planes) overlap.planes.emplace_back(plane.id, plane.id);
  append(a, b, overlap);
  Mapper mapper(MapperOptions(), std::move(a));
  mapper.refine();
  EXPECT_EQ(mapper.map().planes.size(), flat().size());
  const Trajectory path = mapper.trajectory();
  ASSERT_EQ(path.size(), 4u) << "equal stamps: only the first map's";
  const MapState joined = mapper.state();
  for (std::size_t i = 0; i < 4; ++i) {
    const SE3 off =
        joined.graph.keyframes[i].T_map_body.inverse() * joined.graph.keyframes[i + 4].T_map_body;
    EXPECT_LT(off.log().norm(), 0.005) << i;
  }
}

// Views of one keyframe that went to a plane of their own while its piece lies on the other.
TEST(OutlineSharing, NoPlaneIsLeftWithoutAnOutline) {
  MapState map = survey({flat()[1]}, SE3());
  Graph& graph = map.graph;
  const PlaneId old = graph.planes.front().id;
  const Plane leaning = graph.at(old).plane_map().boxplus({0.1, 0, 0.05});
  const PlaneId made = graph.add_plane(PlaneLandmark::at(leaning, {0, 1, 1}));
  const auto views = graph.plane_moments;
  for (const auto& f : views) {
    graph.plane_moments.push_back(f);
    graph.plane_moments.back().plane = made;
  }
  std::vector<OutlinePiece> pieces_old = map.outlines.at(old), pieces_made;
  const std::size_t all = pieces_old.size();
  share_pieces(graph, old, made, pieces_old, pieces_made);
  EXPECT_EQ(pieces_old.size(), all);
  EXPECT_EQ(pieces_made.size(), all);
  // Those of keyframes that see the new plane alone are its own.
  std::erase_if(graph.plane_moments, [&](const PlaneMomentsFactor& f) {
    return f.plane == old && f.keyframe > graph.keyframes[1].id;
  });
  pieces_made.clear();
  share_pieces(graph, old, made, pieces_old, pieces_made);
  EXPECT_EQ(pieces_old.size(), 2u);
  EXPECT_EQ(pieces_made.size(), 2u);
}

TEST(MapState, EveryPlaneOfAMapHasAPolygonOfItsEvidence) {
  MapState map = survey(flat(), SE3());
  const PlaneId bare = map.graph.planes[1].id, unseen = map.graph.planes[2].id;
  for (const PlaneId id : {bare, unseen}) {  // no pieces: as after views that had no outline
    map.outlines.erase(id);
    map.graph.at(id).outline = OutlineGrid(0.1);
  }
  std::erase_if(map.graph.plane_moments,
                [&](const PlaneMomentsFactor& f) { return f.plane == unseen; });
  const PlanarMap result = Mapper(MapperOptions(), map).map();
  EXPECT_EQ(result.planes.size(), flat().size() - 1);
  for (const MapPlane& plane : result.planes) {
    EXPECT_NE(plane.id, static_cast<std::int64_t>(unseen));
    ASSERT_FALSE(plane.outlines_map.empty()) << plane.id;
    EXPECT_GE(plane.outlines_map.front().size(), 3u) << plane.id;
    EXPECT_GT(plane.area, 0) << plane.id;
    for (const auto& x : plane.outlines_map.front()) {
      EXPECT_LT(std::abs(plane.plane_map.signed_distance(x)), 1e-9);
    }
  }
}

}  // namespace
}  // namespace lamina
