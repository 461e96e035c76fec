// Stamps that cannot be, replaced by how a stream of a usual period would run.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <lamina/sensors/clock_order.hpp>
#include <lamina/sensors/readers/stamp_text.hpp>

namespace lamina {
namespace {

using Stamps = std::vector<std::optional<Timestamp>>;

Timestamp at(double seconds) { return Timestamp::from_seconds(seconds); }

// Ten a second from 100 s on.
double truth(std::size_t i) { return 100 + 0.1 * static_cast<double>(i); }

template <class Spoil>
Stamps spoiled(std::size_t count, const Spoil& spoil) {
  Stamps stamps;
  for (std::size_t i = 0; i < count; ++i) stamps.push_back(at(spoil(i)));
  return stamps;
}

double largest_error(const StampSeries& series) {
  double largest = 0;
  for (std::size_t i = 0; i < series.stamps.size(); ++i) {
    largest = std::max(largest, std::abs(series.stamps[i] - at(truth(i))));
  }
  return largest;
}

bool increases(const StampSeries& series) {
  for (std::size_t i = 1; i < series.stamps.size(); ++i) {
    if (series.stamps[i] <= series.stamps[i - 1]) return false;
  }
  return true;
}

TEST(StampSeries, LeavesWhatIncreasesAsItIs) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(-0.04, 0.04);
  const Stamps stamps = spoiled(300, [&](std::size_t i) { return truth(i) + jitter(random); });
  const auto series = ordered_stamps(stamps);
  ASSERT_TRUE(series);
  EXPECT_FALSE(series->first);
  for (std::size_t i = 0; i < stamps.size(); ++i) EXPECT_EQ(series->stamps[i], *stamps[i]);
}

TEST(StampSeries, LaysAFewBetweenTheirNeighbours) {
  const auto series = ordered_stamps(spoiled(300, [](std::size_t i) {
    return i == 50 ? truth(49) : i == 120 ? truth(i) - 3 : i == 200 ? truth(i) + 900 : truth(i);
  }));
  ASSERT_TRUE(series);
  EXPECT_EQ(series->unordered, 3u);
  EXPECT_EQ(series->retimed, 3u);
  EXPECT_EQ(series->first, 50u);
  EXPECT_LT(largest_error(*series), 1e-6);
}

TEST(StampSeries, TakesOutStepsOfTheClock) {
  for (const double back : {0.25, 1.3, 1000.0, -4.29e9}) {
    const auto series = ordered_stamps(
        spoiled(200, [&](std::size_t i) { return truth(i) - (i >= 90 ? back : 0); }));
    ASSERT_TRUE(series) << back;
    ASSERT_EQ(series->steps.size(), 1u) << back;
    EXPECT_EQ(series->steps[0].at, 90u);
    EXPECT_NEAR(series->steps[0].back, back, 1e-3);
    EXPECT_LT(largest_error(*series), 1e-3) << back;
    EXPECT_TRUE(increases(*series));
  }
}

// A record written twice moves nothing that follows.
TEST(StampSeries, ARepeatedRecordIsNoStep) {
  const auto series =
      ordered_stamps(spoiled(200, [](std::size_t i) { return truth(i > 90 ? i - 1 : i); }));
  ASSERT_TRUE(series);
  EXPECT_TRUE(series->steps.empty());
  EXPECT_EQ(series->retimed, 1u);
  EXPECT_EQ(series->stamps[150], at(truth(149)));
}

TEST(StampSeries, APauseIsNone) {
  const Stamps stamps = spoiled(200, [](std::size_t i) { return truth(i) + (i >= 90 ? 1000 : 0); });
  const auto series = ordered_stamps(stamps);
  ASSERT_TRUE(series);
  EXPECT_FALSE(series->first);
}

TEST(StampSeries, SmoothsJitterOfManyPeriods) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> jitter(-0.3, 0.3);
  const auto series =
      ordered_stamps(spoiled(400, [&](std::size_t i) { return truth(i) + jitter(random); }));
  ASSERT_TRUE(series);
  EXPECT_TRUE(increases(*series));
  EXPECT_TRUE(series->steps.empty());
  double squares = 0;
  for (std::size_t i = 30; i < 370; ++i) {
    squares += std::pow(series->stamps[i] - at(truth(i)), 2) / 340;
  }
  EXPECT_LT(std::sqrt(squares), 0.05);  // 0.17 as recorded
}

TEST(StampSeries, SpreadsEqualPairsAndWholeSeconds) {
  const auto pairs = ordered_stamps(spoiled(200, [](std::size_t i) { return truth(i - i % 2); }));
  ASSERT_TRUE(pairs);
  EXPECT_TRUE(increases(*pairs));
  EXPECT_LT(largest_error(*pairs), 0.11);
  const auto seconds =
      ordered_stamps(spoiled(400, [](std::size_t i) { return std::floor(truth(i) + 1e-9); }));
  ASSERT_TRUE(seconds);
  EXPECT_TRUE(increases(*seconds));
  for (std::size_t i = 50; i < 350; ++i) {
    EXPECT_NEAR(seconds->stamps[i] - seconds->stamps[i - 1], 0.1, 0.06) << i;
  }
}

// A logger that stood still, and then wrote at once what had waited.
TEST(StampSeries, SpreadsBursts) {
  const auto series = ordered_stamps(spoiled(300, [](std::size_t i) {
    const std::size_t of = i % 60;
    return of >= 30 && of < 43 ? truth(i + 43 - of) - 0.002 * static_cast<double>(43 - of)
                               : truth(i);
  }));
  ASSERT_TRUE(series);
  EXPECT_EQ(series->bursts, 5u);
  EXPECT_LT(largest_error(*series), 0.02);
}

TEST(StampSeries, SaysNothingWhereStampsDo) {
  EXPECT_FALSE(ordered_stamps(Stamps(100, at(0))));
  EXPECT_FALSE(ordered_stamps(Stamps(100, std::nullopt)));
  EXPECT_FALSE(
      ordered_stamps(spoiled(2000, [](std::size_t i) { return i < 900 ? 1.13486e9 : 1.13487e9; })));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(0, 50);
  EXPECT_FALSE(ordered_stamps(spoiled(200, [&](std::size_t) { return any(random); })));
}

TEST(ClockOrder, StreamsWithoutAClockTakeThatOfTheLinesAboutThem) {
  ClockStream scans{"scans", Stamps(50, at(0)), {}}, odometry{"odometry", {}, {}};
  for (std::size_t i = 0; i < 50; ++i) {
    scans.lines.push_back(2 * i + 1);
    odometry.stamps.push_back(at(truth(i)));
    odometry.lines.push_back(2 * i);
  }
  const OrderedClock clock = order_clocks(std::vector{scans, odometry});
  for (std::size_t i = 0; i < 49; ++i) {
    EXPECT_NEAR(clock.stamps[0][i] - at(truth(i)), 0.05, 1e-6);
    EXPECT_EQ(clock.stamps[1][i], at(truth(i)));
  }
  ASSERT_EQ(clock.warnings.size(), 1u);
  EXPECT_EQ(clock.warnings[0].id, "clock_order");
}

TEST(ClockOrder, WithNoClockAtAllLinesStandEvenly) {
  ClockStream scans{"scans", Stamps(50, at(7)), {}}, odometry{"odometry", Stamps(50, at(0)), {}};
  for (std::size_t i = 0; i < 50; ++i) {
    scans.lines.push_back(2 * i + 1);
    odometry.lines.push_back(2 * i);
  }
  ClockOrderOptions options;
  options.nominal_interval = 0.4;
  const OrderedClock clock = order_clocks(std::vector{scans, odometry}, options);
  EXPECT_EQ(clock.stamps[0][0], at(7));
  EXPECT_NEAR(clock.stamps[0][49] - clock.stamps[0][0], 0.4 * 49, 1e-6);
  EXPECT_NEAR(clock.stamps[1][10] - clock.stamps[0][9], 0.2, 1e-6);
  EXPECT_EQ(clock.warnings.size(), 1u);  // one cause
}

TEST(ClockOrder, ClocksThatAreDaysApartAreLaidTogether) {
  ClockStream scans{"scans", {}, {}}, odometry{"odometry", {}, {}};
  for (std::size_t i = 0; i < 80; ++i) {
    scans.stamps.push_back(at(truth(i) + 0.05));
    scans.lines.push_back(2 * i + 1);
    odometry.stamps.push_back(at(truth(i) + 260000));
    odometry.lines.push_back(2 * i);
  }
  const OrderedClock clock = order_clocks(std::vector{scans, odometry});
  EXPECT_NEAR(clock.stamps[1][40] - at(truth(40)), 0, 0.02);
  ASSERT_EQ(clock.warnings.size(), 1u);
  EXPECT_EQ(clock.warnings[0].id, "clocks_apart");
}

TEST(StampSeries, LinesInAnyOrderAreShuffledIfTheirStampsAreEvenOnceSorted) {
  std::vector<Timestamp> even, jitter, back;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> late(0, 0.4);
  for (int i = 0; i < 200; ++i) {
    even.push_back(at(0.1 * i));
    jitter.push_back(at(0.1 * i + late(random)));
    back.push_back(at(i < 120 ? 0.1 * i : 0.1 * i - 5.05));
  }
  EXPECT_FALSE(is_shuffled(even));
  EXPECT_FALSE(is_shuffled(jitter));
  EXPECT_FALSE(is_shuffled(back));
  std::vector<Timestamp> reversed(even.rbegin(), even.rend()), shuffled;
  for (std::size_t i = 0; i < 200; ++i) shuffled.push_back(even[i * 73 % 200]);
  EXPECT_TRUE(is_shuffled(reversed));
  EXPECT_TRUE(is_shuffled(shuffled));
}

TEST(StampText, CountsMicrosecondsWithoutTheirZeros) {
  MicrosecondCheck unpadded, padded, tenths;
  for (int i = 0; i < 200; ++i) {
    const int micro = i * 70000 % 1000000, second = 12 + i * 70000 / 1000000;
    char text[40];
    std::snprintf(text, sizeof text, "%d.%d", second, micro);
    unpadded.add(*read_stamp(text));
    std::snprintf(text, sizeof text, "%d.%06d", second, micro);
    padded.add(*read_stamp(text));
    std::snprintf(text, sizeof text, "%.1f", 12 + 0.1 * i);
    tenths.add(*read_stamp(text));
  }
  EXPECT_TRUE(unpadded.found());
  EXPECT_FALSE(padded.found());
  EXPECT_FALSE(tenths.found());
  EXPECT_EQ(read_stamp("12.345")->microseconds->to_string(), "12.000345");
}

TEST(StampText, RubbishIsANumberWithoutATime) {
  for (const char* rubbish : {"5.45506e-312", "1e300", "nan"}) {
    const auto stamp = read_stamp(rubbish);
    ASSERT_TRUE(stamp) << rubbish;
    EXPECT_FALSE(stamp->decimal && *stamp->decimal != at(0)) << rubbish;
  }
  EXPECT_FALSE(read_stamp("host"));
  EXPECT_FALSE(read_stamp(""));
}

}  // namespace
}  // namespace lamina
