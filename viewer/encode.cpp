// Base64 and quantised layers.
#include <lamina/viewer/encode.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace lamina::viewer {

std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < n ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= n ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

std::string base64(std::span<const float> values) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(4 * values.size());
  for (const float value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (int shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::uint8_t>(bits >> shift & 255U));
    }
  }
  return base64(std::span<const std::uint8_t>(bytes));
}

std::vector<std::uint8_t> run_lengths(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> out;
  std::size_t literal = 0;  // where the bytes begin that stand as they are
  const auto flush = [&](std::size_t end) {
    while (literal < end) {
      const std::size_t n = std::min<std::size_t>(128, end - literal);
      out.push_back(static_cast<std::uint8_t>(n - 1));
      for (std::size_t k = 0; k < n; ++k) out.push_back(bytes[literal++]);
    }
  };
  for (std::size_t i = 0; i < bytes.size();) {
    std::size_t n = 1;
    while (n < 130 && i + n < bytes.size() && bytes[i + n] == bytes[i]) ++n;
    if (n >= 3) {
      flush(i);
      out.push_back(static_cast<std::uint8_t>(n + 125));
      out.push_back(bytes[i]);
      literal = i + n;
    }
    i += n;
  }
  flush(bytes.size());
  return out;
}

Quantised quantise(std::span<const float> values) {
  Quantised q;
  float least = std::numeric_limits<float>::infinity(), largest = -least;
  for (const float value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    largest = std::max(largest, value);
  }
  if (least <= largest) {
    q.least = least;
    q.largest = largest;
  }
  const double range = static_cast<double>(q.largest) - static_cast<double>(q.least);
  q.codes.reserve(values.size());
  for (const float value : values) {
    if (!std::isfinite(value)) {
      q.codes.push_back(kNanCode);
    } else {
      const double part = range > 0 ? (static_cast<double>(value) - q.least) / range : 0.0;
      q.codes.push_back(static_cast<std::uint8_t>(std::lround(254 * part)));
    }
  }
  return q;
}

std::size_t thinning_stride(std::size_t count, std::size_t most) {
  return std::max<std::size_t>(1, (count + most - 1) / most);
}

}  // namespace lamina::viewer
