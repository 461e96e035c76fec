// What a run says of itself at its end.
#include <gtest/gtest.h>

#include <lamina/apps/doubts.hpp>

namespace lamina::apps {
namespace {

std::vector<std::string> doubts_of(double open_images, double open_way) {
  const FrontEnd front_end({}, {});
  io::Metrics metrics;
  metrics.counts = {{"steps", 1000},
                    {"steps_with_open_direction", open_images},
                    {"open_direction_longest_m", open_way}};
  return doubts("recording", front_end, metrics);
}

TEST(Doubts, ALongWayAlongABareWallIsTold) {
  const auto told = doubts_of(150, 1.3);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("open over 1.3 m of way in a row"), std::string::npos) << told[0];
}

TEST(Doubts, ShortGlancesAreNot) { EXPECT_TRUE(doubts_of(150, 0.3).empty()); }

TEST(Doubts, MostImagesOpenIsToldOnce) {
  const auto told = doubts_of(800, 5);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("800 of 1000 images"), std::string::npos) << told[0];
}

TEST(Doubts, ScansAloneInABareCorridorAreTold) {
  const FrontEnd front_end({}, {});
  io::Metrics metrics;
  metrics.counts = {
      {"steps", 1000}, {"scans_with_open_direction", 100}, {"scans_open_direction_longest_m", 6.2}};
  const auto told = doubts("recording", front_end, metrics);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("100 scans left a direction"), std::string::npos) << told[0];
  EXPECT_NE(told[0].find("over 6.2 m of way in a row"), std::string::npos) << told[0];
  metrics.counts["scans_open_direction_longest_m"] = 0.4;
  EXPECT_TRUE(doubts("recording", front_end, metrics).empty());
}

TEST(Doubts, AWayByWheelsAloneIsToldWhereItMatters) {
  const FrontEnd front_end({}, {});
  io::Metrics metrics;
  metrics.counts = {{"steps", 1000},
                    {"path_m", 52},
                    {"by_wheels_alone_m", 48},
                    {"way_by_wheels_alone_m", 47},
                    {"heading_by_wheels_alone_m", 30},
                    {"by_wheels_alone_sigma_m", 1.3}};
  const auto told = doubts("recording", front_end, metrics);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("wheels alone told 48 of 52 m"), std::string::npos) << told[0];
  EXPECT_NE(told[0].find("off by some 1.3 m"), std::string::npos) << told[0];
  metrics.counts["by_wheels_alone_sigma_m"] = 0.1;
  EXPECT_TRUE(doubts("recording", front_end, metrics).empty());
}

}  // namespace
}  // namespace lamina::apps
