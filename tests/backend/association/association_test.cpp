// Gates and reasons of association, the index, outlines, surfels, labels, place recognition.
#include <lamina/backend/association/association.hpp>

#include <gtest/gtest.h>

#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/association/place_recognition.hpp>
#include <lamina/backend/association/plane_index.hpp>
#include <lamina/backend/consistency/split_candidates.hpp>
#include <lamina/backend/mapper/plane_labels.hpp>
#include <lamina/backend/mapper/surfel_estimator.hpp>

namespace lamina {
namespace {

// A square metre of a plane around `middle`, sigma 1 cm a point, 400 points.
PlaneEvidence square_of(const Plane& plane, const Eigen::Vector3d& middle) {
  PlaneEvidence e;
  e.plane_body = plane;
  const Eigen::Vector3d c = plane.project(middle);
  const Matrix32d B = plane.tangent_basis();
  const double w = 400 / 1e-4;
  e.moments_body = Moments(w, c, B * (w / 12) * B.transpose(), 400);
  for (const auto& [u, v] : {std::pair{-.5, -.5}, {.5, -.5}, {.5, .5}, {-.5, .5}}) {
    e.outline_body.push_back(c + B * Eigen::Vector2d(u, v));
  }
  return e;
}

AssociationCandidate candidate(int id, const Plane& plane) {
  AssociationCandidate c;
  c.id = PlaneId(id);
  c.plane_anchor = plane;
  return c;
}

TEST(Associate, GivesTheReason) {
  const AssociationOptions options;
  const Plane wall({-1, 0, 0}, -3);
  const PlaneEvidence seen = square_of(wall, {3, 0, 1});
  const auto reason = [&](const Plane& known) {
    const std::vector<AssociationCandidate> candidates{candidate(5, known)};
    return associate(seen, SE3(), candidates, options);
  };
  EXPECT_EQ(reason(wall).plane, PlaneId(5));
  EXPECT_EQ(reason(wall).reason, AssociationReason::kMatched);
  EXPECT_LT(reason(wall).chi_squared, 1e-6);
  EXPECT_EQ(reason(wall.flipped()).reason, AssociationReason::kOtherSide);
  EXPECT_EQ(reason(Plane({-1, 0.5, 0}, -3)).reason, AssociationReason::kAngle);
  EXPECT_EQ(reason(Plane({-1, 0, 0}, -4)).reason, AssociationReason::kDistance);
  EXPECT_EQ(reason(Plane({-1, 0, 0}, -3.05)).reason, AssociationReason::kChiSquared);
  EXPECT_EQ(associate(seen, SE3(), {}, options).reason, AssociationReason::kNoCandidate);
  EXPECT_EQ(associate(PlaneEvidence(), SE3(), {}, options).reason, AssociationReason::kTooWeak);
  EXPECT_STREQ(to_string(AssociationReason::kChiSquared), "chi-squared");
}

TEST(Associate, UncertaintyOfThePredictionWidensTheGate) {
  const AssociationOptions options;
  const PlaneEvidence seen = square_of(Plane({-1, 0, 0}, -3), {3, 0, 1});
  auto known = candidate(1, Plane({-1, 0, 0}, -3.05));
  EXPECT_GT(innovation_chi_squared(seen, SE3(), known, options), 16.3);
  known.covariance(0, 0) = 0.05 * 0.05;  // x of the pose
  EXPECT_LT(innovation_chi_squared(seen, SE3(), known, options), 2);
  known.covariance.setZero();
  known.covariance(1, 1) = 0.05 * 0.05;  // y does not matter to this wall
  EXPECT_GT(innovation_chi_squared(seen, SE3(), known, options), 16.3);
  known.covariance(8, 8) = 0.05 * 0.05;  // nor did the plane know its distance
  EXPECT_LT(innovation_chi_squared(seen, SE3(), known, options), 2);
}

TEST(Associate, ASegmentDoesNotJudgeTheTiltItCannotSee) {
  PlaneEvidence seen;
  seen.partial = true;
  seen.plane_body = Plane({-1, 0, 0}, -3);
  const double w = 50 / 1e-4;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  scatter(1, 1) = w / 12;
  seen.moments_body = Moments(w, {3, 0, 0}, scatter, 50);
  const Eigen::Vector3d tilted(-std::cos(0.15), 0, std::sin(0.15));
  const std::vector<AssociationCandidate> leaning{
      candidate(1, Plane(tilted, tilted.dot(Eigen::Vector3d(3, 0, 0))))};
  EXPECT_EQ(associate(seen, SE3(), leaning, {}).plane, PlaneId(1));
  const Eigen::Vector3d turned(-std::cos(0.15), std::sin(0.15), 0);
  const std::vector<AssociationCandidate> away{
      candidate(1, Plane(turned, turned.dot(Eigen::Vector3d(3, 0, 0))))};
  EXPECT_EQ(associate(seen, SE3(), away, {}).reason, AssociationReason::kChiSquared);
}

TEST(Associate, TwoThatFitAlikeAreUsedForNeither) {
  const PlaneEvidence seen = square_of(Plane({-1, 0, 0}, -3), {3, 0, 1});
  std::vector<AssociationCandidate> two{candidate(1, Plane({-1, 0, 0}, -2.9)),
                                        candidate(2, Plane({-1, 0, 0}, -3.1))};
  for (auto& c : two) c.covariance(0, 0) = 0.04;
  EXPECT_EQ(associate(seen, SE3(), two, {}).reason, AssociationReason::kAmbiguous);
  two[1].plane_anchor = Plane({-1, 0, 0}, -3.0);
  two[0].covariance(0, 0) = two[1].covariance(0, 0) = 0.001;
  EXPECT_EQ(associate(seen, SE3(), two, {}).plane, PlaneId(2));
}

TEST(Associate, OneViewTellsASlabFromItsWall) {
  const AssociationOptions options;
  const Plane wall({-1, 0, 0}, -3), slab({-1, 0, 0}, -2.96);
  const PlaneEvidence here = square_of(wall, {3, 0, 1}), beside = square_of(wall, {3, 1.5, 1});
  const PlaneEvidence before = square_of(slab, {3, 1.5, 1});
  EXPECT_LT(disagreement_in_view(here, beside, options), 1);
  EXPECT_GT(disagreement_in_view(here, before, options), options.gate_full);
  PlaneEvidence stroke = before;
  stroke.partial = true;  // a stroke's normal is not seen
  EXPECT_EQ(disagreement_in_view(here, stroke, options), 0);
}

TEST(PlaneIndex, FindsWhatIsNearAndFollowsRenames) {
  PlaneIndex index(1.5);
  const std::vector<Eigen::Vector3d> here{{0, 0, 0}, {1, 0, 0}}, there{{20, 0, 0}};
  index.insert(PlaneId(4), here);
  index.insert(PlaneId(2), here);
  index.insert(PlaneId(9), there);
  EXPECT_EQ(index.near(here), (std::vector<PlaneId>{PlaneId(2), PlaneId(4)}));
  EXPECT_EQ(index.near(there), (std::vector<PlaneId>{PlaneId(9)}));
  index.rename(PlaneId(9), PlaneId(2));
  EXPECT_EQ(index.near(there), (std::vector<PlaneId>{PlaneId(2)}));
  index.remove(PlaneId(2));
  EXPECT_TRUE(index.near(there).empty());
  const std::vector<Eigen::Vector3d> nowhere{{std::nan(""), 0, 0}, {1e300, 0, 0}};
  index.insert(PlaneId(1), nowhere);
  EXPECT_EQ(index.near(here), (std::vector<PlaneId>{PlaneId(4)}));
}

TEST(PlaneIndex, WhatIsCloseIsWithinOneSmallCube) {
  PlaneIndex index(1.5);
  const std::vector<Eigen::Vector3d> square{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
  index.insert_outline(PlaneId(3), square);
  const auto close_to = [&index](double x) {
    const std::vector<Eigen::Vector3d> place{{x, 1, 0}};
    return !index.near_close(place).empty();
  };
  EXPECT_TRUE(close_to(1));  // inside, between the corners
  EXPECT_TRUE(close_to(2.7));
  EXPECT_FALSE(close_to(3.6));
  const std::vector<Eigen::Vector3d> beyond{{3.6, 1, 0}};
  EXPECT_EQ(index.near(beyond), (std::vector<PlaneId>{PlaneId(3)}));
  index.rename(PlaneId(3), PlaneId(1));
  EXPECT_EQ(index.near_close(square), (std::vector<PlaneId>{PlaneId(1)}));
  index.remove(PlaneId(1));
  EXPECT_FALSE(close_to(1));
}

TEST(SampleOutline, IsDenseOnBorderAndInside) {
  const std::vector<Eigen::Vector3d> square{{0, 0, 1}, {4, 0, 1}, {4, 4, 1}, {0, 4, 1}};
  const auto points = sample_outline(square, 1.0);
  for (double x = 0; x <= 4; x += 0.5) {
    for (double y = 0; y <= 4; y += 0.5) {
      double nearest = 1e9;
      for (const auto& p : points)
        nearest = std::min(nearest, (p - Eigen::Vector3d(x, y, 1)).norm());
      EXPECT_LE(nearest, 0.75);
    }
  }
  const std::vector<Eigen::Vector3d> stroke{{0, 0, 0}, {0, 3, 0}};
  EXPECT_EQ(sample_outline(stroke, 1.0).size(), 4u);
}

TEST(Boundaries, AreConcaveWhereTheEvidenceIs) {
  PlaneLandmark wall = PlaneLandmark::at(Plane({0, -1, 0}, -2), {0, 2, 1});
  const std::vector<Eigen::Vector3d> left{{0, 2, 0}, {1, 2, 0}, {1, 2, 3}, {0, 2, 3}};
  const std::vector<Eigen::Vector3d> low{{0, 2, 0}, {3, 2, 0}, {3, 2, 1}, {0, 2, 1}};
  grow_outline(wall, left);
  grow_outline(wall, low);
  const auto outlines = outlines_map(wall);
  ASSERT_EQ(outlines.size(), 1u);
  EXPECT_NEAR(wall.outline.area(), 5.0, 0.25);  // an L of 5 m^2, its hull has 7
  for (const auto& p : outlines[0]) EXPECT_NEAR(p.y(), 2, 1e-9);
  EXPECT_GT((outline_centroid_map(wall) - Eigen::Vector3d(1.5, 2, 1.5)).norm(), 0.2);
}

// Cells that a border only passed made walls up to 10 cm too long at every end.
TEST(Boundaries, AnOutlineEndsWithinHalfACellOfWhatWasSeen) {
  PlaneLandmark wall = PlaneLandmark::at(Plane({0, -1, 0}, -2), {0, 2, 1});
  for (const double shift : {0.0, 0.01, 0.02, 0.03}) {
    const double a = -1.02 - shift, b = 1.03 - shift;
    wall.outline = OutlineGrid(0.1);
    const std::vector<Eigen::Vector3d> seen{{a, 2, 0.02}, {b, 2, 0.02}, {b, 2, 1.5}, {a, 2, 1.5}};
    grow_outline(wall, seen);
    double low = 9, high = -9;
    const auto outlines = outlines_map(wall);
    ASSERT_EQ(outlines.size(), 1u);
    for (const auto& p : outlines[0]) {
      low = std::min(low, p.x());
      high = std::max(high, p.x());
    }
    EXPECT_NEAR(low, a, 0.0501) << shift;
    EXPECT_NEAR(high, b, 0.0501) << shift;
  }
}

TEST(Boundaries, WhatIsThinnerThanACellIsKept) {
  PlaneLandmark face = PlaneLandmark::at(Plane({0, -1, 0}, -2), {0, 2, 0.02});
  for (const double low : {0.0, 0.03, 0.06, 0.09}) {
    face.outline = OutlineGrid(0.1);
    const double high = low + 0.02;
    const std::vector<Eigen::Vector3d> seen{{0, 2, low}, {1, 2, low}, {1, 2, high}, {0, 2, high}};
    grow_outline(face, seen);
    EXPECT_GE(face.outline.area(), 0.1) << low;
    EXPECT_TRUE(face.outline.contains(
        (face.T_map_outline.inverse() * Eigen::Vector3d(0.5, 2, low + 0.01)).head<2>()))
        << low;
  }
}

TEST(Boundaries, AThinPieceThatSlantsHasNoHoles) {
  PlaneLandmark face = PlaneLandmark::at(Plane({0, -1, 0}, -2), {0, 2, 0.02});
  face.outline = OutlineGrid(0.1);
  const std::vector<Eigen::Vector3d> seen{{0, 2, -0.01}, {1, 2, 0.09}, {1, 2, 0.11}, {0, 2, 0.01}};
  grow_outline(face, seen);
  for (double x = 0.01; x < 1; x += 0.01) {
    const Eigen::Vector3d p(x, 2, 0.1 * x);
    EXPECT_TRUE(face.outline.contains((face.T_map_outline.inverse() * p).head<2>())) << x;
  }
}

TEST(Surfels, AStepOf1CmIsNotIronedFlat) {
  const Plane floor;
  const double w = 60 / (0.003 * 0.003);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  scatter(0, 0) = scatter(1, 1) = w * 0.01 / 12;
  SurfelOptions options;
  options.parent_sigma_m = 0.002;
  const auto flat =
      solve_surfel(Moments(w, {0.05, 0.05, 0.0005}, scatter, 60), {0.05, 0.05}, &floor, options);
  const auto slab =
      solve_surfel(Moments(w, {0.05, 0.05, 0.01}, scatter, 60), {0.05, 0.05}, &floor, options);
  ASSERT_TRUE(flat && slab);
  EXPECT_NEAR(flat->height, 0.0005, 0.0003);
  EXPECT_NEAR(slab->height, 0.01, 0.0007);
  EXPECT_LT(std::sqrt(slab->covariance(0, 0)), 0.001);
  EXPECT_FALSE(solve_surfel(Moments(), {0, 0}, &floor, options));
}

TEST(Surfels, SlopesComeFromTheEvidence) {
  Moments m;
  for (double x = 0; x < 0.1; x += 0.01) {
    for (double y = 0; y < 0.1; y += 0.01) m.add({x, y, 0.3 + 0.1 * x - 0.2 * y}, 1e6);
  }
  SurfelOptions options;
  options.parent_slope = 10;
  const auto cell = solve_surfel(m, {0.05, 0.05}, nullptr, options);
  ASSERT_TRUE(cell);
  EXPECT_NEAR(cell->slope.x(), 0.1, 1e-4);
  EXPECT_NEAR(cell->slope.y(), -0.2, 1e-4);
  EXPECT_NEAR(cell->height, 0.3 + 0.005 - 0.01, 1e-4);
}

MapPlane map_plane(int id, const Plane& plane, const Eigen::Vector3d& middle, double area) {
  MapPlane p;
  p.id = id;
  p.plane_map = plane;
  p.centroid_map = plane.project(middle);
  p.area = area;
  return p;
}

TEST(Labels, ByTiltHeightAndPath) {
  const Eigen::Vector3d ramp(-std::sin(0.09), 0, std::cos(0.09));
  std::vector<MapPlane> planes{map_plane(0, Plane(), {0, 0, 0}, 20),
                               map_plane(1, Plane({0, 0, 1}, 0.15), {3, 0, 0}, 1),
                               map_plane(2, Plane({0, 0, 1}, 0.75), {3, 3, 0}, 1),
                               map_plane(3, Plane({1, 0, 0.02}, -2), {-2, 0, 1}, 8),
                               map_plane(4, Plane({0, 0, -1}, -2.5), {0, 0, 2.5}, 9),
                               map_plane(5, Plane(ramp, 0), {1, 0, 0}, 3),
                               map_plane(6, Plane({1, 0, 1}, 0), {1, 0, 0}, 3),
                               map_plane(7, Plane({0, 0, 1}, 0.008), {6, 0, 0}, 5)};
  Trajectory path;
  path.add(Timestamp::from_nanoseconds(1), SE3());
  label_planes(planes, path, {});
  const std::vector<PlaneLabel> expected{
      PlaneLabel::kFloor,   PlaneLabel::kStep, PlaneLabel::kOther, PlaneLabel::kWall,
      PlaneLabel::kCeiling, PlaneLabel::kRamp, PlaneLabel::kOther, PlaneLabel::kFloor};
  for (std::size_t i = 0; i < planes.size(); ++i) EXPECT_EQ(planes[i].label, expected[i]) << i;
  // A camera carried at 1.3 m: what it is carried over is the floor all the same.
  Trajectory carried;
  carried.add(Timestamp::from_nanoseconds(1), SE3::from_translation({0, 0, 1.3}));
  planes.push_back(map_plane(8, Plane({0, 0, 1}, 1.2), {2, 0, 1.2}, 0.3));  // a shelf
  label_planes(planes, carried, {});
  EXPECT_EQ(planes[0].label, PlaneLabel::kFloor);
  EXPECT_EQ(planes[1].label, PlaneLabel::kStep);
  std::vector<MapPlane> none;
  label_planes(none, path, {});
  EXPECT_TRUE(none.empty());
}

// Two sides of a roof taken for one: what the refiner rejected becomes the other side.
TEST(SplitRejected, MakesAPlaneOfWhatAgrees) {
  Graph graph;
  const Plane left({-0.5, 0, 1}, 0), right({0.5, 0, 1}, 0);
  const PlaneId id = graph.add_plane(PlaneLandmark::at(left, {1, 0, 0.5}));
  std::vector<FactorRef> rejected;
  for (int i = 0; i < 8; ++i) {
    const KeyframeId keyframe = graph.add_keyframe({}, SE3::from_translation({0, 0.3 * i, 0}));
    const Plane& side = i < 4 ? left : right;
    const Moments m = square_of(side, {i < 4 ? 1.0 : -1.0, 0, 0}).moments_body;
    graph.plane_moments.push_back({keyframe, id, m, ExtrinsicsId::kNone, i < 4 ? 1.0 : 0.0});
    if (i >= 4) rejected.push_back({FactorType::kPlaneMoments, std::size_t(i)});
  }
  // One that fits neither stays rejected.
  graph.plane_moments.back().moments_body = square_of(Plane({0, 0, 1}, 7), {0, 0, 7}).moments_body;
  const auto split = split_rejected(graph, rejected);
  ASSERT_EQ(split.size(), 1u);
  EXPECT_EQ(split[0].first, id);
  EXPECT_LT(angle_between(graph.at(split[0].second).plane_map(), right), 1e-6);
  EXPECT_EQ(graph.plane_moments[5].plane, split[0].second);
  EXPECT_EQ(graph.plane_moments[5].weight, 1);
  EXPECT_EQ(graph.plane_moments[7].plane, id);
  EXPECT_EQ(graph.plane_moments[7].weight, 0);
  EXPECT_TRUE(graph.problems().empty());
  EXPECT_TRUE(split_rejected(graph, {}).empty());
}

RecognitionPlane known(int id, const Plane& plane, const Eigen::Vector3d& middle) {
  RecognitionPlane p;
  p.id = PlaneId(id);
  p.plane_map = plane;
  p.middle_map = plane.project(middle);
  p.covariance = Eigen::Vector3d(1e-5, 1e-5, 1e-5).asDiagonal();
  return p;
}

// An irregular room, and the same met again by a robot that believes to be elsewhere.
std::vector<RecognitionPlane> room(int id, bool square = false) {
  const double a = square ? 0 : 0.3;
  return {known(id, Plane({-1, 0, 0}, -4), {4, 0, 1}),
          known(id + 1, Plane({1, a, 0}, -3), {-3, 0, 1}),
          known(id + 2, Plane({0, -1, 0}, -2.5), {0, 2.5, 1}),
          known(id + 3, Plane({a, 1, 0}, -3.5), {1, -3.5, 1}),
          known(id + 4, Plane({0, 0, 1}, 0), {0, 0, 0})};
}

PlaneIndex index_of(const std::vector<RecognitionPlane>& planes) {
  PlaneIndex index(1.5);
  for (const auto& p : planes) index.insert(p.id, std::span(&p.middle_map, 1));
  return index;
}

TEST(PlaceRecognition, FindsTheMotionThatAllPlanesAgreeOn) {
  const auto old = room(10);
  const SE3 truth(SO3::rot_z(0.08), {0.6, -0.4, 0});
  auto fresh = room(100);
  for (auto& p : fresh) {
    p.plane_map = truth.inverse() * p.plane_map;
    p.middle_map = truth.inverse() * p.middle_map;
  }
  const auto match = recognise_place(fresh, old, index_of(old), {0, 0, 0}, 3, {});
  ASSERT_TRUE(match);
  EXPECT_EQ(match->pairs.size(), 5u);
  EXPECT_LT((match->T_old_new.inverse() * truth).log().norm(), 0.02);
  for (const auto& [a, b] : match->pairs) EXPECT_EQ(int(a) - 100, int(b) - 10);
}

TEST(PlaceRecognition, DoesNotBelieveWhatItCannotVerify) {
  const auto old = room(10);
  auto fresh = room(100);
  // A corridor: two parallel walls and the floor leave one direction open.
  const std::vector<RecognitionPlane> corridor{fresh[2], fresh[4],
                                               known(107, Plane({0, 1, 0}, -3.5), {0, -3.5, 1}),
                                               known(108, Plane({0, -1, 0}, -2.5), {2, 2.5, 1})};
  EXPECT_FALSE(recognise_place(corridor, old, index_of(old), {0, 0, 0}, 3, {}));
  // Another room altogether.
  const std::vector<RecognitionPlane> other{known(101, Plane({-1, 0, 0}, -2.2), {2.2, 0, 1}),
                                            known(102, Plane({1, 0, 0}, -1.9), {-1.9, 0, 1}),
                                            known(103, Plane({0, -1, 0}, -1.0), {0, 1, 1}),
                                            known(104, Plane({0.3, 1, 0}, -1.2), {0, -1.2, 1})};
  EXPECT_FALSE(recognise_place(other, old, index_of(old), {0, 0, 0}, 3, {}));
  EXPECT_FALSE(recognise_place({}, old, index_of(old), {0, 0, 0}, 3, {}));
  EXPECT_FALSE(recognise_place(fresh, {}, PlaneIndex(), {0, 0, 0}, 3, {}));
}

}  // namespace
}  // namespace lamina
