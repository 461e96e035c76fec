// Base64 and quantised layers.
#include <gmock/gmock.h>

#include <limits>

#include <lamina/viewer/encode.hpp>

namespace lamina::viewer {
namespace {

std::string base64_of(const std::string& text) {
  return base64(std::vector<std::uint8_t>(text.begin(), text.end()));
}

// The vectors of RFC 4648, section 10.
TEST(Encode, Base64OfTheRfc) {
  EXPECT_EQ(base64_of(""), "");
  EXPECT_EQ(base64_of("f"), "Zg==");
  EXPECT_EQ(base64_of("fo"), "Zm8=");
  EXPECT_EQ(base64_of("foo"), "Zm9v");
  EXPECT_EQ(base64_of("foobar"), "Zm9vYmFy");
}

TEST(Encode, FloatsAreLittleEndian) {
  EXPECT_EQ(base64(std::vector<float>{1.0F}), "AACAPw==");  // 00 00 80 3f
}

TEST(Encode, QuantisedWithinHalfAStep) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> values = {-1.0F, 0.3F, nan, 4.0F,
                                     std::numeric_limits<float>::infinity()};
  const Quantised q = quantise(values);
  ASSERT_EQ(q.codes.size(), values.size());
  EXPECT_EQ(q.least, -1.0F);
  EXPECT_EQ(q.largest, 4.0F);
  EXPECT_EQ(q.codes[2], kNanCode);
  EXPECT_EQ(q.codes[4], kNanCode);
  for (const std::size_t k : {0U, 1U, 3U}) {
    EXPECT_NEAR(q.least + q.codes[k] / 254.0 * 5.0, values[k], 0.5 * 5.0 / 254 + 1e-6);
  }
}

TEST(Encode, QuantisedConstantAndUnknown) {
  EXPECT_THAT(quantise(std::vector<float>{2.0F, 2.0F}).codes, testing::Each(0));
  const Quantised none = quantise(std::vector<float>{std::numeric_limits<float>::quiet_NaN()});
  EXPECT_EQ(none.least, 0);
  EXPECT_EQ(none.largest, 0);
  EXPECT_THAT(none.codes, testing::ElementsAre(kNanCode));
}

TEST(Encode, RunLengths) {
  using Bytes = std::vector<std::uint8_t>;
  EXPECT_EQ(run_lengths(Bytes{}), Bytes{});
  EXPECT_EQ(run_lengths(Bytes{5, 5, 6}), (Bytes{2, 5, 5, 6}));
  EXPECT_EQ(run_lengths(Bytes{1, 9, 9, 9, 2}), (Bytes{0, 1, 128, 9, 0, 2}));
  EXPECT_EQ(run_lengths(Bytes(131, 7)), (Bytes{255, 7, 0, 7}));
  EXPECT_EQ(run_lengths(Bytes(1'000'000, 255)).size(), 2 * (1'000'000 + 129) / 130);
}

TEST(Encode, RunLengthsComeBack) {
  std::vector<std::uint8_t> bytes;
  for (std::uint32_t i = 0, x = 1; i < 5000; ++i) {
    x = x * 1664525U + 1013904223U;
    bytes.insert(bytes.end(), 1 + (x >> 24U) % 5, static_cast<std::uint8_t>(x >> 16U));
  }
  const auto packed = run_lengths(bytes);
  std::vector<std::uint8_t> back;
  for (std::size_t i = 0; i < packed.size();) {
    const std::uint8_t c = packed[i++];
    if (c < 128) {
      back.insert(back.end(), &packed[i], &packed[i] + c + 1);
      i += c + 1U;
    } else {
      back.insert(back.end(), c - 125U, packed[i++]);
    }
  }
  EXPECT_EQ(back, bytes);
}

TEST(Encode, ThinningKeepsToItsBound) {
  EXPECT_EQ(thinning_stride(0, 10), 1U);
  EXPECT_EQ(thinning_stride(10, 10), 1U);
  EXPECT_EQ(thinning_stride(11, 10), 2U);
}

}  // namespace
}  // namespace lamina::viewer
