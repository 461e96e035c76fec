// CARMEN logs whose clocks are broken, compressed logs, and what is written beside them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <functional>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/compressed_text.hpp>
#include <lamina/sensors/recording.hpp>

#include "sensors/temporary_folder.hpp"

namespace lamina {
namespace {
using test::TemporaryFolder;
using testing::HasSubstr;

// A robot that drives along x at 0.5 m/s: two ODOM lines, then a scan, 0.1 s apart.
std::string log_of(int lines, const std::function<std::string(int, double)>& stamp) {
  std::string text;
  for (int i = 0; i < lines; ++i) {
    const double t = 10 + 0.1 * i;
    const std::string x = std::to_string(0.05 * i), s = stamp(i, t), end = s + " host " + s + "\n";
    if (i % 3 == 2) {
      text += "FLASER 3 1 2 3 " + x + " 0 0 " + x + " 0 0 " + end;
    } else {
      text += "ODOM " + x + " 0 0 0.5 0 0 " + end;
    }
  }
  return text;
}

std::string decimal(double t) { return std::to_string(t); }

struct Read {
  std::vector<LaserScan> scans;
  std::vector<Odometry> odometry;
  std::vector<Warning> warnings;
  SkippedCounts skipped;
};

Read read(const std::string& file) {
  const auto recording = open_recording(file);
  Read all;
  while (const auto m = recording->next()) {
    if (const auto* scan = std::get_if<LaserScan>(&*m)) all.scans.push_back(*scan);
    if (const auto* odometry = std::get_if<Odometry>(&*m)) all.odometry.push_back(*odometry);
  }
  all.warnings = recording->warnings();
  all.skipped = recording->skipped();
  return all;
}

// Every scan is there, later than the one before, with the wheels where its line stands.
void expect_in_order(const Read& all, std::size_t scans, double slack) {
  ASSERT_EQ(all.scans.size(), scans);
  ASSERT_EQ(all.odometry.size(), scans);
  for (std::size_t k = 0; k < scans; ++k) {
    if (k > 0) {
      EXPECT_GT(all.scans[k].stamp, all.scans[k - 1].stamp) << k;
    }
    EXPECT_NEAR(all.odometry[k].T_odom_body.translation().x(), 0.05 * (3.0 * double(k) + 2), slack)
        << k;
  }
}

TEST(CarmenClock, ReadsLinesInOrderWhereStampsCannot) {
  const TemporaryFolder folder;
  const auto broken = [&](const std::function<std::string(int, double)>& stamp) {
    folder.write("a.log", log_of(300, stamp));
    const Read all = read(folder.file("a.log"));
    expect_in_order(all, 100, 0.051);
    EXPECT_EQ(all.warnings.size(), 1u);
    if (!all.warnings.empty()) {
      EXPECT_EQ(all.warnings[0].id, "clock_order");
      EXPECT_THAT(all.warnings[0].text, HasSubstr("a.log:"));
    }
  };
  broken([](int, double) { return "0"; });
  broken([](int i, double) { return i < 100 ? "1.13486e+09" : "1.13487e+09"; });
  broken([](int i, double) { return i % 3 == 2 ? "0" : "5.45506e-312"; });
  broken([](int i, double t) { return decimal(i < 150 ? t : t + 4294967290.0); });
  broken([](int i, double t) { return decimal(i < 150 ? t : t - 1.3); });
  broken([](int i, double t) { return decimal(i < 150 ? t : t - 1000); });
}

TEST(CarmenClock, GoodStampsAreLeftAlone) {
  const TemporaryFolder folder;
  folder.write("a.log", log_of(300, [](int, double t) { return decimal(t); }));
  const Read all = read(folder.file("a.log"));
  expect_in_order(all, 100, 1e-5);
  EXPECT_TRUE(all.warnings.empty());
  EXPECT_EQ(all.scans[10].stamp.to_string(), "13.200000");
}

TEST(CarmenClock, MicrosecondsWithoutTheirZeros) {
  const TemporaryFolder folder;
  folder.write("a.log", log_of(600, [](int, double t) {
                 const auto whole = static_cast<int>(t + 0.0305);
                 const auto micro = static_cast<int>(std::lround((t + 0.0305 - whole) * 1e6));
                 return std::to_string(whole) + "." + std::to_string(micro);
               }));
  const Read all = read(folder.file("a.log"));
  expect_in_order(all, 200, 1e-4);
  ASSERT_EQ(all.warnings.size(), 1u);
  EXPECT_EQ(all.warnings[0].id, "stamp_digits");
}

TEST(CarmenClock, CompressedLogsAreReadAsTheyAre) {
  const TemporaryFolder folder;
  const std::string text = log_of(300, [](int, double t) { return decimal(t); });
  gzFile out = gzopen(folder.file("a.log.gz").c_str(), "wb");
  gzwrite(out, text.data(), static_cast<unsigned>(text.size()));
  gzclose(out);
  expect_in_order(read(folder.file("a.log.gz")), 100, 1e-5);
  const std::string bytes = read_text_bytes(folder.file("a.log.gz")).text;
  EXPECT_EQ(bytes, text);
}

TEST(CompressedText, CutDataGiveWhatWasGoodAndBombsAreRefused) {
  const TemporaryFolder folder;
  const std::string text = log_of(3000, [](int i, double t) { return decimal(t + 1e-6 * i); });
  gzFile out = gzopen(folder.file("a.gz").c_str(), "wb");
  gzwrite(out, text.data(), static_cast<unsigned>(text.size()));
  gzclose(out);
  std::string packed;
  {
    std::ifstream in(folder.file("a.gz"), std::ios::binary);
    packed.assign(std::istreambuf_iterator<char>(in), {});
  }
  folder.write("cut.gz", packed.substr(0, packed.size() / 2));
  const TextBytes cut = read_text_bytes(folder.file("cut.gz"));
  EXPECT_TRUE(cut.cut);
  EXPECT_EQ(text.substr(0, cut.text.size()), cut.text);
  EXPECT_GT(cut.text.size(), text.size() / 4);
  TextLimits limits;
  limits.largest = 1 << 16;
  EXPECT_THROW(read_text_bytes(folder.file("a.gz"), limits), Error);
  limits = {};
  limits.longest_line = 20;
  EXPECT_THROW(read_text_bytes(folder.file("a.gz"), limits), Error);
}

}  // namespace
}  // namespace lamina
