// Times and errors: exact text, one-line messages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include <lamina/models/error.hpp>
#include <lamina/models/timestamp.hpp>

#include "support/random.hpp"

namespace lamina::test {
namespace {

TEST(Timestamp, ReadsDecimalSecondsExactly) {
  EXPECT_EQ(Timestamp::parse("1341836538.891350")->nanoseconds(), 1341836538891350000);
  EXPECT_EQ(Timestamp::parse("0.000000001")->nanoseconds(), 1);
  EXPECT_EQ(Timestamp::parse("1.0000000019")->nanoseconds(), 1000000001) << "cut below 1 ns";
  EXPECT_EQ(Timestamp::parse("-1.5")->nanoseconds(), -1500000000);
  EXPECT_EQ(Timestamp::parse("7")->nanoseconds(), 7000000000);
  EXPECT_EQ(Timestamp::parse(".5")->nanoseconds(), 500000000);
  EXPECT_EQ(Timestamp::parse("5.")->nanoseconds(), 5000000000);
  EXPECT_EQ(Timestamp::parse("1.5e3")->nanoseconds(), 1500000000000);
}

TEST(Timestamp, RefusesWhatIsNoTime) {
  for (const char* text : {"", "-", ".", "abc", "1.2.3", "1,5", " 1", "1 ", "nan", "inf", "1e",
                           "1e999", "0x10", "99999999999999999999", "--1", "1e11", "+-3", "1.5x"}) {
    EXPECT_FALSE(Timestamp::parse(text)) << "'" << text << "'";
  }
}

TEST(Timestamp, TextComesBackExactly) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const auto ns =
        static_cast<std::int64_t>(random.uniform(-4.5e18, 4.5e18)) >> random.integer(0, 62);
    const Timestamp stamp = Timestamp::from_nanoseconds(ns);
    const auto back = Timestamp::parse(stamp.to_string());
    ASSERT_TRUE(back) << stamp.to_string();
    EXPECT_EQ(back->nanoseconds(), ns);
  }
  EXPECT_EQ(Timestamp::from_nanoseconds(1500000000).to_string(), "1.500000");
  EXPECT_EQ(Timestamp::from_nanoseconds(1).to_string(), "0.000000001");
  EXPECT_EQ(Timestamp::from_nanoseconds(-1).to_string(), "-0.000000001");
}

TEST(Timestamp, FromSecondsRounds) {
  EXPECT_EQ(Timestamp::from_seconds(0.1).nanoseconds(), 100000000);
  EXPECT_EQ(Timestamp::from_seconds(-0.1).nanoseconds(), -100000000);
  EXPECT_EQ(Timestamp::from_seconds(1.5e9).nanoseconds(), 1500000000000000000);
}

TEST(Timestamp, FromSecondsOutOfRangeIsAnError) {
  EXPECT_THROW(Timestamp::from_seconds(std::numeric_limits<double>::quiet_NaN()), Error);
  EXPECT_THROW(Timestamp::from_seconds(std::numeric_limits<double>::infinity()), Error);
  EXPECT_THROW(Timestamp::from_seconds(1e11), Error);
}

TEST(Timestamp, Arithmetic) {
  const Timestamp a = *Timestamp::parse("1341836538.891350"), b = a + 0.25;
  EXPECT_EQ(b - a, 0.25);
  EXPECT_EQ(a - b, -0.25);
  EXPECT_LT(a, b);
  EXPECT_EQ(b + -0.25, a);
  EXPECT_NEAR(a.seconds(), 1341836538.891350, 1e-6);
}

TEST(Error, NamesFilePlaceFoundAndExpected) {
  EXPECT_STREQ(input_error("a.yaml", "3", "'x'", "a number").what(),
               "a.yaml:3: found 'x', expected a number");
  EXPECT_STREQ(input_error("a.yaml", "", "nothing", "").what(), "a.yaml: found nothing");
}

TEST(Error, CheckThrowsWhenAPromiseIsBroken) {
  EXPECT_NO_THROW(LAMINA_CHECK(1 + 1 == 2));
  try {
    LAMINA_CHECK(1 + 1 == 3);
    FAIL() << "did not throw";
  } catch (const std::logic_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("1 + 1 == 3"));
    EXPECT_THAT(error.what(), testing::HasSubstr("timestamp_test.cpp"));
  }
}

}  // namespace
}  // namespace lamina::test
