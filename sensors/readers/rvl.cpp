// Nibbles in words of 32 bits, the first one topmost.
#include <lamina/sensors/readers/rvl.hpp>

namespace lamina {
namespace {

// Three bits of a number a nibble, the lowest first; the fourth says that more follow.
class Nibbles {
 public:
  Nibbles(const unsigned char* bytes, std::size_t size)
      : bytes_(bytes), count_(2 * (size & ~std::size_t{3})) {}

  std::optional<std::uint32_t> number() {
    std::uint32_t value = 0;
    for (int shift = 0; shift < 32; shift += 3) {
      if (next_ == count_) return std::nullopt;
      // Words are little-endian, so the eight nibbles of a word run from its last byte to its
      // first.
      const std::size_t word = next_ / 8, within = next_ % 8;
      const unsigned char byte = bytes_[4 * word + 3 - within / 2];
      const std::uint32_t nibble = within % 2 == 0 ? byte >> 4 : byte & 15u;
      ++next_;
      value |= (nibble & 7u) << shift;
      if ((nibble & 8u) == 0) return value;
    }
    return std::nullopt;
  }

 private:
  const unsigned char* bytes_;
  std::size_t count_, next_ = 0;
};

class NibbleWriter {
 public:
  void number(std::uint32_t value) {
    do {
      std::uint32_t nibble = value & 7u;
      value >>= 3;
      if (value != 0) nibble |= 8u;
      word_ = word_ << 4 | nibble;
      if (++filled_ == 8) flush();
    } while (value != 0);
  }
  std::vector<unsigned char> finish() {
    if (filled_ > 0) {
      word_ <<= 4 * (8 - filled_);
      flush();
    }
    return std::move(bytes_);
  }

 private:
  void flush() {
    for (int shift = 0; shift < 32; shift += 8)
      bytes_.push_back(static_cast<unsigned char>(word_ >> shift & 255u));
    word_ = 0;
    filled_ = 0;
  }
  std::vector<unsigned char> bytes_;
  std::uint32_t word_ = 0;
  unsigned filled_ = 0;
};

}  // namespace

std::optional<std::vector<std::uint16_t>> decode_rvl(const unsigned char* bytes, std::size_t size,
                                                     std::size_t pixels) {
  Nibbles in(bytes, size);
  std::vector<std::uint16_t> out;
  std::uint32_t last = 0;  // without sign: damaged bytes may hold any difference
  while (out.size() < pixels) {
    const auto zeros = in.number(), values = in.number();
    if (!zeros || !values) return std::nullopt;
    if (std::uint64_t{*zeros} + *values > pixels - out.size()) return std::nullopt;
    if (*zeros + *values == 0) return std::nullopt;
    out.resize(out.size() + *zeros, 0);
    for (std::uint32_t i = 0; i < *values; ++i) {
      const auto code = in.number();
      if (!code) return std::nullopt;
      last += (*code & 1u) != 0 ? ~(*code >> 1) : *code >> 1;
      out.push_back(static_cast<std::uint16_t>(last));
    }
  }
  return out;
}

std::vector<unsigned char> encode_rvl(const std::vector<std::uint16_t>& pixels) {
  NibbleWriter out;
  std::int32_t last = 0;
  for (std::size_t i = 0; i < pixels.size();) {
    const std::size_t first = i;
    while (i < pixels.size() && pixels[i] == 0) ++i;
    const std::size_t begin = i;
    while (i < pixels.size() && pixels[i] != 0) ++i;
    out.number(static_cast<std::uint32_t>(begin - first));
    out.number(static_cast<std::uint32_t>(i - begin));
    for (std::size_t k = begin; k < i; ++k) {
      const std::int32_t difference = pixels[k] - last;
      const auto magnitude =
          static_cast<std::uint32_t>(difference < 0 ? -difference - 1 : difference);
      out.number(magnitude << 1 | (difference < 0 ? 1u : 0u));
      last = pixels[k];
    }
  }
  return out.finish();
}

}  // namespace lamina
