// Graph, window, outlines and index of a map in motion change together.
#include <gtest/gtest.h>

#include <lamina/models/error.hpp>

#include "backend/mapper/corner_map.hpp"

namespace lamina {
namespace {

using namespace made_up;  // NOLINT

TEST(WorkingMap, AnObservedPlaneIsInGraphWindowOutlinesAndIndex) {
  const WorkingMap map = make_corner();
  EXPECT_EQ(map.graph.plane_moments.size(), 3u);
  EXPECT_TRUE(map.window.contains(PlaneId(1)));
  EXPECT_EQ(map.outlines.at(PlaneId(1)).size(), 1u);
  const std::vector<Eigen::Vector3d> wall{{3, 0, 1}};
  EXPECT_EQ(map.index.near_close(wall), std::vector<PlaneId>{PlaneId(1)});
  EXPECT_TRUE(map.graph.problems().empty());
}

TEST(WorkingMap, MoreViewsOfOneKeyframeAreOneFactor) {
  WorkingMap map = make_corner();
  map.observe(PlaneId(0), evidence_of(corner_planes()[0], SE3()), Timestamp());
  EXPECT_EQ(map.graph.plane_moments.size(), 3u);
  EXPECT_EQ(map.outlines.at(PlaneId(0)).size(), 1u);
}

TEST(WorkingMap, APriorIsInGraphAndWindowOrInNeither) {
  WorkingMap map = make_corner();
  EXPECT_TRUE(map.hold(PlaneId(2), map.graph.at(PlaneId(2)).plane_anchor, 0.1, 0.1));
  EXPECT_EQ(map.graph.marginal_priors.size(), 1u);
  EXPECT_FALSE(map.hold(PlaneId(7), Plane(), 0.1, 0.1));
  EXPECT_EQ(map.graph.marginal_priors.size(), 1u);
}

TEST(WorkingMap, MovedOutlinesAreFoundWherePlanesWent) {
  WorkingMap map = make_corner();
  map.move(SE3::from_translation({10, 0, 0}));
  const std::vector<Eigen::Vector3d> before{{3, 0, 1}}, after{{13, 0, 1}};
  EXPECT_TRUE(map.index.near_close(before).empty());
  EXPECT_EQ(map.index.near_close(after), std::vector<PlaneId>{PlaneId(1)});
}

TEST(WorkingMap, OptionsThatCannotBeThrow) {
  MapperOptions options;
  options.outline_cell_m = 0;
  EXPECT_THROW(WorkingMap{options}, Error);
}

}  // namespace
}  // namespace lamina
