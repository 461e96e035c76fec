// Percentiles of stage times, and the JSON of them.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include <lamina/io/metrics.hpp>

namespace lamina::io {
namespace {

TEST(StageTimes, PercentilesAreNearestRank) {
  StageTimes times;
  for (int i = 1; i <= 100; ++i) times.add(i);
  EXPECT_EQ(times.percentile_ms(50), 50);
  EXPECT_EQ(times.percentile_ms(99), 99);
  EXPECT_EQ(times.percentile_ms(100), 100);
  EXPECT_EQ(times.max_ms(), 100);
  EXPECT_EQ(times.calls(), 100);
}

TEST(StageTimes, EmptyIsZero) {
  const StageTimes times;
  EXPECT_EQ(times.percentile_ms(50), 0);
  EXPECT_EQ(times.calls(), 0);
}

TEST(StageTimes, StaysGoodOverAMillionCalls) {
  StageTimes times;
  for (int i = 0; i < 1'000'000; ++i) times.add(i % 1000);
  EXPECT_EQ(times.calls(), 1'000'000);
  EXPECT_NEAR(times.percentile_ms(50), 500, 5);
  EXPECT_NEAR(times.percentile_ms(99), 990, 10);
  EXPECT_EQ(times.max_ms(), 999);
  EXPECT_LE(times.percentile_ms(100), 999);
}

TEST(StageTimes, TheRareSlowOneIsNotForgotten) {
  StageTimes times;
  for (int i = 0; i < 100'000; ++i) times.add(i % 50 == 7 ? 40.0 : 1e-5);
  EXPECT_EQ(times.percentile_ms(97), 0);  // below what is told apart
  EXPECT_NEAR(times.percentile_ms(99), 40, 0.4);
}

TEST(MemoryTrace, SamplesByTheRecordingsTimeAndStaysShort) {
  MemoryTrace trace;
  for (int i = 0; i <= 100'000; ++i) trace.note(1000.0 + i);
  ASSERT_GT(trace.samples().size(), 300u);
  EXPECT_LT(trace.samples().size(), 721u);
  EXPECT_EQ(trace.samples().front().time_s, 0);
  EXPECT_GT(trace.samples().back().time_s, 99'000);
  for (std::size_t i = 0; i < trace.samples().size(); ++i) {
    EXPECT_GT(trace.samples()[i].rss_mb, 1);
    if (i > 0) {
      EXPECT_GE(trace.samples()[i].time_s - trace.samples()[i - 1].time_s, 10);
    }
  }
}

TEST(Metrics, WritesTheKeysOfTheContract) {
  Diagnostics metrics;
  metrics.stages["segments"].add(0.5);
  metrics.refine = RefinementFigures{0.25, 7, "converged", {}, 0.1};
  metrics.skipped["missing file"] = 3;
  metrics.warn("clock_order", "stamps go back");
  metrics.warn("clock_order", "and again");
  metrics.assumed = {"lidar at the body's origin"};
  metrics.calibration = {{"wheel scale", 1, 1.02, 0.001, 40, true}};
  metrics.readings = 2;
  const auto file = std::filesystem::temp_directory_path() / "lamina_metrics_test.json";
  write_metrics(file, metrics);
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in);
  EXPECT_EQ(json["stages"]["segments"]["calls"], 1);
  EXPECT_EQ(json["stages"]["segments"]["p99_ms"], 0.5);
  EXPECT_EQ(json["refine"]["iterations"], 7);
  EXPECT_EQ(json["refine"]["status"], "converged");
  EXPECT_GT(json["peak_rss_mb"].get<double>(), 1);
  EXPECT_EQ(json["skipped"]["missing file"], 3);
  ASSERT_EQ(json["warnings"].size(), 1U);  // one a cause
  EXPECT_EQ(json["warnings"][0]["id"], "clock_order");
  EXPECT_EQ(json["warnings"][0]["text"], "stamps go back");
  EXPECT_EQ(json["assumed"][0], "lidar at the body's origin");
  EXPECT_EQ(json["calibration"][0]["found"], 1.02);
  EXPECT_TRUE(json["calibration"][0]["adopted"].get<bool>());
  EXPECT_EQ(json["readings"], 2);
  std::filesystem::remove(file);
}

TEST(Metrics, MemorysTimesHaveNoBinaryNoise) {
  Diagnostics metrics;
  metrics.memory.note(1000.1);
  metrics.memory.note(1017.2);  // 17.100000000000023 later
  const auto file = std::filesystem::temp_directory_path() / "lamina_metrics_times_test.json";
  write_metrics(file, metrics);
  std::ifstream in(file);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  EXPECT_NE(text.find("\"time_s\": 17.1,"), std::string::npos) << text;
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace lamina::io
