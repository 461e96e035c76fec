// Frames on file come back bit for bit, and hang where their keyframe's heir is.
#include <lamina/backend/mapper/frame_log.hpp>

#include <gtest/gtest.h>

#include <filesystem>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

MapFrame frame(int i) {
  Vector6d d;
  d << 0.1 * i, std::sin(0.3 * i), 0.01, 0.002 * i, -0.1, 0.7 * i;
  return {Timestamp::from_nanoseconds(1000 * i), KeyframeId(std::int64_t(i) / 7), SE3::exp(d)};
}

std::vector<MapFrame> all(const FrameLog& log) {
  std::vector<MapFrame> frames;
  log.for_each([&](const MapFrame& f) { frames.push_back(f); });
  return frames;
}

void expect_same(const std::vector<MapFrame>& a, const std::vector<MapFrame>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].stamp, b[i].stamp);
    ASSERT_EQ(a[i].keyframe, b[i].keyframe);
    ASSERT_EQ(a[i].T_keyframe_body.translation(), b[i].T_keyframe_body.translation());
    ASSERT_EQ(a[i].T_keyframe_body.so3().quaternion().coeffs(),
              b[i].T_keyframe_body.so3().quaternion().coeffs());
  }
}

TEST(FrameLog, OnFileAsInMemoryBitForBit) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "lamina_frame_log";
  std::filesystem::create_directories(folder);
  FrameLog memory, file;
  file.keep_in(folder);
  std::vector<MapFrame> expected;
  const int count = 3 * static_cast<int>(FrameLog::kBlock) + 100;
  for (int i = 0; i < count; ++i) {
    memory.add(frame(i));
    file.add(frame(i));
    expected.push_back(frame(i));
    if (i % 50 != 49) continue;
    // A keyframe goes that no frame will be added to any more.
    const std::int64_t newest = i / 7;
    const KeyframeId gone{newest - 1}, into{newest - 2};
    const SE3 T = SE3::planar(0.1, 0.02, 0.3);
    for (FrameLog* log : {&memory, &file}) log->transfer(gone, into, T);
    for (MapFrame& f : expected) {
      if (f.keyframe != gone) continue;
      f.keyframe = into;
      f.T_keyframe_body = T * f.T_keyframe_body;
    }
  }
  EXPECT_EQ(file.size(), static_cast<std::size_t>(count));
  expect_same(all(memory), expected);
  expect_same(all(file), expected);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST(FrameLog, HandedOverTwiceAsDoneAtOnce) {
  FrameLog log;
  const SE3 A = SE3::planar(1, 2, 0.3), B = SE3::planar(-0.5, 0.1, 0.2);
  std::vector<MapFrame> expected;
  for (int i = 0; i < 30; ++i) log.add(frame(i));
  log.transfer(KeyframeId(3), KeyframeId(2), A);
  log.transfer(KeyframeId(2), KeyframeId(0), B);
  for (int i = 0; i < 30; ++i) {
    MapFrame f = frame(i);
    if (f.keyframe == KeyframeId(3)) f = {f.stamp, KeyframeId(2), A * f.T_keyframe_body};
    if (f.keyframe == KeyframeId(2)) f = {f.stamp, KeyframeId(0), B * f.T_keyframe_body};
    expected.push_back(f);
  }
  expect_same(all(log), expected);
}

TEST(FrameLog, CopiesGoOnByThemselves) {
  FrameLog log;
  log.keep_in(testing::TempDir());
  const int block = static_cast<int>(FrameLog::kBlock);
  for (int i = 0; i < block; ++i) log.add(frame(i));
  FrameLog copy = log;
  std::vector<MapFrame> of_log, of_copy;
  for (int i = 0; i < block; ++i) of_log.push_back(frame(i)), of_copy.push_back(frame(i));
  for (int i = block; i < 2 * block; ++i) {
    log.add(frame(i));
    copy.add(frame(5 * i));
    of_log.push_back(frame(i));
    of_copy.push_back(frame(5 * i));
  }
  expect_same(all(log), of_log);
  expect_same(all(copy), of_copy);
}

TEST(FrameLog, SaysWhereItCannotWrite) {
  FrameLog log;
  log.keep_in("/nonexistent");
  const auto fill = [&] {
    for (int i = 0; i < 2000; ++i) log.add(frame(i));
  };
  EXPECT_THROW(fill(), Error);
}

}  // namespace
}  // namespace lamina
