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

TEST(Encode, ThinningKeepsToItsBound) {
  EXPECT_EQ(thinning_stride(0, 10), 1U);
  EXPECT_EQ(thinning_stride(10, 10), 1U);
  EXPECT_EQ(thinning_stride(11, 10), 2U);
}

}  // namespace
}  // namespace lamina::viewer
