// The body's pose beside its keyframe, from planes held still.
#include <gtest/gtest.h>

#include <lamina/backend/mapper/localization.hpp>

#include "backend/mapper/corner_map.hpp"

namespace lamina {
namespace {

using namespace made_up;  // NOLINT

std::vector<PlaneEvidence> seen_from(const SE3& T_map_body) {
  std::vector<PlaneEvidence> all;
  for (const Plane& plane : corner_planes()) all.push_back(evidence_of(plane, T_map_body));
  return all;
}

std::vector<AssociationDecision> all_known() {
  std::vector<AssociationDecision> decisions(3);
  for (std::size_t i = 0; i < 3; ++i) decisions[i].plane = static_cast<PlaneId>(i);
  return decisions;
}

TEST(Localization, ThreePlanesPutTheBodyWhereItIs) {
  const WorkingMap map = make_corner();
  const SE3 truth(SO3::exp({0.01, -0.02, 0.03}), {0.05, -0.04, 0.03});
  BodyInKeyframe predicted;
  predicted.covariance = 0.01 * Matrix6d::Identity();
  const auto found = localized(map, seen_from(truth), all_known(), predicted);
  EXPECT_LT((found.T_keyframe_body.inverse() * truth).log().norm(), 0.002);
  EXPECT_LT(found.covariance.trace(), 0.1 * predicted.covariance.trace());
}

TEST(Localization, ViewsOfNoPlaneLeaveThePrediction) {
  const WorkingMap map = make_corner();
  BodyInKeyframe predicted;
  predicted.advance(SE3::from_translation({0.1, 0, 0}), 0.01 * Matrix6d::Identity());
  const auto found =
      localized(map, seen_from(SE3()), std::vector<AssociationDecision>(3), predicted);
  EXPECT_LT((found.T_keyframe_body.inverse() * predicted.T_keyframe_body).log().norm(), 1e-12);
  EXPECT_TRUE(found.covariance.isApprox(predicted.covariance, 1e-9));
}

}  // namespace
}  // namespace lamina
