// Numbers and strings of one message in CDR, the form in which ROS 2 records and sends them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace lamina::ros2 {

/// The bytes are no such message: they end early, or claim more than they hold.
class DamagedCdr : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads in the order of a message's fields; little or big endian as its first four bytes say, and
/// aligned as XCDR version 1 has it [DDSXTypes]. Every function throws DamagedCdr. `message` has to
/// outlive the reader.
class CdrReader {
 public:
  explicit CdrReader(std::string_view message);
  ~CdrReader();

  std::uint8_t u8();
  std::uint32_t u32();
  std::int32_t i32();
  float f32();
  double f64();
  std::string string();
  /// The length of a sequence whose items take `least` bytes or more: never more than can follow.
  std::size_t length(std::size_t least);
  std::vector<float> floats();
  std::vector<double> doubles();
  /// A sequence of bytes, where it lies.
  std::string_view bytes();

 private:
  std::size_t left() const;
  struct Stream;
  std::unique_ptr<Stream> stream_;
};

}  // namespace lamina::ros2
