// Depth images of bags: raw, PNG and RVL behind compressedDepth's header.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include <lamina/sensors/readers/bag_depth.hpp>
#include <lamina/sensors/readers/png_image.hpp>
#include <lamina/sensors/readers/rvl.hpp>

namespace lamina::bag {
namespace {

const std::vector<std::uint16_t> kDepth = {0, 0, 1000, 1002, 990, 0, 65535, 1, 0, 0, 0, 7};

std::string as_text(const std::vector<unsigned char>& bytes) {
  return std::string(bytes.begin(), bytes.end());
}

template <class Number>
std::string raw(Number value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

std::string header(float a, float b) { return raw(std::int32_t{0}) + raw(a) + raw(b); }
std::string rvl() {
  return raw(std::uint32_t{4}) + raw(std::uint32_t{3}) + as_text(encode_rvl(kDepth));
}
std::string png() { return encode_png_depth({4, 3, kDepth}); }

bool read(const std::string& format, const std::string& bytes, Message& out) {
  DepthReader reader;
  const void* data = bytes.data();
  out = Message();
  return reader.read({format, static_cast<const unsigned char*>(data), bytes.size()}, out);
}

TEST(BagDepth, RunLengthsRoundTrip) {
  std::vector<std::uint16_t> pixels(5000);
  std::uint32_t state = 1;
  for (auto& pixel : pixels) {
    state = state * 1664525u + 1013904223u;
    pixel = state >> 30 == 0 ? 0 : static_cast<std::uint16_t>(state >> 16);
  }
  const auto bytes = encode_rvl(pixels);
  EXPECT_EQ(decode_rvl(bytes.data(), bytes.size(), pixels.size()), pixels);
  EXPECT_FALSE(decode_rvl(bytes.data(), bytes.size() / 2, pixels.size()));
  EXPECT_FALSE(decode_rvl(bytes.data(), bytes.size(), pixels.size() - 1));
  EXPECT_FALSE(decode_rvl(bytes.data(), 0, 1));
}

// Two values by hand: no zeros (0), two values (2), +5 (10 = 1|010, 001), -1 (1).
TEST(BagDepth, RunLengthsAreThePublishedOnes) {
  const unsigned char word[4] = {0x00, 0x10, 0xa1, 0x02};  // nibbles 0 2 a 1 1 0 0 0
  EXPECT_EQ(decode_rvl(word, 4, 2), (std::vector<std::uint16_t>{5, 4}));
  EXPECT_EQ(encode_rvl({5, 4}), std::vector<unsigned char>(word, word + 4));
}

TEST(BagDepth, PackedImages) {
  Message out;
  ASSERT_TRUE(read("16UC1; compressedDepth png", header(0, 0) + png(), out));
  EXPECT_EQ(out.depth, kDepth);
  EXPECT_EQ(out.width, 4);
  EXPECT_EQ(out.height, 3);
  ASSERT_TRUE(read("16UC1; compressedDepth", header(0, 0) + png(), out));
  EXPECT_EQ(out.depth, kDepth);
  ASSERT_TRUE(read("16UC1; compressedDepth rvl", header(0, 0) + rvl(), out));
  EXPECT_EQ(out.depth, kDepth);
  ASSERT_TRUE(read("16UC1; png compressed ", png(), out));
  EXPECT_EQ(out.depth, kDepth);
}

// Floats are packed as A / depth + B: near ones finer.
TEST(BagDepth, PackedFloats) {
  const float a = 1000, b = 20;
  Message out;
  ASSERT_TRUE(read("32FC1; compressedDepth rvl", header(a, b) + rvl(), out));
  ASSERT_EQ(out.kind, Kind::kDepth);
  for (std::size_t i = 0; i < kDepth.size(); ++i) {
    const double metres = kDepth[i] == 0 ? 0 : 1000.0 / (kDepth[i] - 20.0);
    EXPECT_NEAR(out.depth[i], metres > 0 ? 1000 * metres : 0, 0.6) << i;
  }
}

TEST(BagDepth, DamagedAndOtherImagesAreRefused) {
  Message out;
  for (const std::string& whole : {header(0, 0) + rvl(), header(0, 0) + png()}) {
    const char* format =
        whole[13] == 'P' ? "16UC1; compressedDepth png" : "16UC1; compressedDepth rvl";
    for (std::size_t size = 0; size + 4 < whole.size(); ++size)
      EXPECT_FALSE(read(format, whole.substr(0, size), out)) << format << size;
  }
  EXPECT_FALSE(read("rgb8; jpeg compressed bgr8", png(), out));
  const std::string claim = raw(std::uint32_t{0x7fffffff}) + raw(std::uint32_t{0x7fffffff});
  EXPECT_FALSE(read("16UC1; compressedDepth rvl", header(0, 0) + claim + "abcd", out));
}

}  // namespace
}  // namespace lamina::bag
