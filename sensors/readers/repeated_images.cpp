// Lines next to each other, compared by stamp first.
#include <lamina/sensors/readers/repeated_images.hpp>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string_view>

#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {

bool same_bytes(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code error;
  const auto size = std::filesystem::file_size(a, error);
  if (error || size != std::filesystem::file_size(b, error) || error) return false;
  std::ifstream first(a, std::ios::binary), second(b, std::ios::binary);
  using Bytes = std::istreambuf_iterator<char>;
  return std::equal(Bytes(first), Bytes(), Bytes(second), Bytes());
}

}  // namespace

std::string without_repeated_images(std::string text, const std::filesystem::path& folder,
                                    std::int64_t& repeats) {
  std::string_view line, last_stamp, last_path;
  repeats = 0;
  for (LineReader lines(text); lines.next(line);) {
    if (line.empty() || is_comment(line)) continue;
    const auto start = static_cast<std::size_t>(line.data() - text.data());
    const std::string_view stamp = next_field(line), path = next_field(line);
    if (!path.empty() && stamp == last_stamp &&
        same_bytes(folder / std::string(last_path), folder / std::string(path))) {
      text[start] = '#';  // of the same length: views of other lines stay
      ++repeats;
      continue;
    }
    last_stamp = stamp;
    last_path = path;
  }
  return text;
}

}  // namespace lamina
