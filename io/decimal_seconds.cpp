// Through the stamp's own decimal text.
#include <lamina/io/decimal_seconds.hpp>

#include <charconv>
#include <string>

#include <lamina/models/error.hpp>

namespace lamina::io {

double decimal_seconds(Timestamp stamp) {
  const std::string text = stamp.to_string();
  double seconds = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), seconds);
  LAMINA_CHECK(read.ec == std::errc());
  return seconds;
}

}  // namespace lamina::io
