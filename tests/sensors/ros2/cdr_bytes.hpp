// A message in CDR by hand, for tests: fields in order, aligned, in either byte order.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>

namespace lamina::test {

class CdrBytes {
 public:
  explicit CdrBytes(bool big_endian = false) : big_(big_endian), bytes_{'\0', '\1', '\0', '\0'} {
    if (big_) bytes_[1] = '\0';
  }
  template <class Number>
  CdrBytes& put(Number value) {
    while ((bytes_.size() - 4) % sizeof value != 0) bytes_ += '\0';
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    if (big_ == (std::endian::native == std::endian::little)) std::reverse(raw, raw + sizeof value);
    bytes_.append(raw, sizeof value);
    return *this;
  }
  CdrBytes& text(const std::string& value) {
    put(static_cast<std::uint32_t>(value.size() + 1));
    bytes_ += value;
    bytes_ += '\0';
    return *this;
  }
  CdrBytes& blob(const std::string& value) {
    put(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
    return *this;
  }
  CdrBytes& header(std::int32_t seconds, std::uint32_t nanoseconds, const std::string& frame) {
    return put(seconds).put(nanoseconds).text(frame);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  bool big_;
  std::string bytes_;
};

}  // namespace lamina::test
