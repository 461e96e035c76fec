// Fast CDR with lengths checked before anything is allocated.
#include <lamina/sensors/ros2/cdr_reader.hpp>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>

namespace lamina::ros2 {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

struct CdrReader::Stream {
  explicit Stream(std::string_view message)
      : end(message.data() + message.size()),
        buffer(const_cast<char*>(message.data()), message.size()),
        cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR) {}
  const char* end;
  FastBuffer buffer;
  Cdr cdr;

  template <class Number>
  Number get() {
    Number value{};
    try {
      cdr.deserialize(value);
    } catch (const eprosima::fastcdr::exception::Exception&) {
      throw DamagedCdr("ends within a number");
    }
    return value;
  }
};

CdrReader::CdrReader(std::string_view message) {
  // Two bytes of the representation, big endian; two of options. 0 and 1: plain CDR.
  if (message.size() < 4) throw DamagedCdr("shorter than its own header");
  if (message[0] != 0 || (message[1] != 0 && message[1] != 1))
    throw DamagedCdr("another representation than plain CDR");
  stream_ = std::make_unique<Stream>(message);
  stream_->cdr.read_encapsulation();
}

CdrReader::~CdrReader() = default;

std::size_t CdrReader::left() const {
  return static_cast<std::size_t>(stream_->end - stream_->cdr.getCurrentPosition());
}

std::uint8_t CdrReader::u8() { return stream_->get<std::uint8_t>(); }
std::uint32_t CdrReader::u32() { return stream_->get<std::uint32_t>(); }
std::int32_t CdrReader::i32() { return stream_->get<std::int32_t>(); }
float CdrReader::f32() { return stream_->get<float>(); }
double CdrReader::f64() { return stream_->get<double>(); }

std::size_t CdrReader::length(std::size_t least) {
  const std::size_t count = u32();
  if (count > left() / least) throw DamagedCdr("a sequence longer than the message");
  return count;
}

std::string_view CdrReader::bytes() {
  const std::size_t count = length(1);
  const char* begin = stream_->cdr.getCurrentPosition();
  // Its alignment knows of what was read, not of what was passed over: the last byte is read.
  if (count > 0) {
    if (!stream_->cdr.jump(count - 1)) throw DamagedCdr("ends within bytes");
    u8();
  }
  return {begin, count};
}

// With a zero at its end.
std::string CdrReader::string() {
  const std::string_view text = bytes();
  return std::string(text.substr(0, text.find('\0')));
}

std::vector<float> CdrReader::floats() {
  std::vector<float> values(length(sizeof(float)));
  for (float& value : values) value = f32();
  return values;
}

std::vector<double> CdrReader::doubles() {
  std::vector<double> values(length(sizeof(double)));
  for (double& value : values) value = f64();
  return values;
}

}  // namespace lamina::ros2
