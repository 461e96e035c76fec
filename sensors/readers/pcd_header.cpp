// Parses and checks .pcd headers.
#include <lamina/sensors/readers/pcd_header.hpp>

#include <cstring>
#include <vector>

#include <lamina/models/error.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {
constexpr std::int64_t kMostPoints = 1'000'000'000;
constexpr std::int64_t kMostFields = 256;
constexpr std::int64_t kLzfExpansion = 140;  // LZF copies at most 264 bytes for 2 or 3

class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, const std::string& file)
      : bytes_(bytes), file_(file), lines_(bytes) {}

  PcdHeader read() {
    std::string_view line;
    while (header_.data.empty()) {
      const bool more = lines_.next(line);
      if (!more || line.size() > 4096) fail("no DATA line", "a .pcd header");
      if (is_comment(line)) continue;
      key(line);
    }
    header_.data_begin = static_cast<std::size_t>(line.data() - bytes_.data()) + line.size();
    while (header_.data_begin < bytes_.size() && bytes_[header_.data_begin] != '\n') {
      ++header_.data_begin;
    }
    header_.data_begin = std::min(header_.data_begin + 1, bytes_.size());
    check_fields();
    check_size();
    return header_;
  }

 private:
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw input_error(file_, std::to_string(lines_.number()), found, expected);
  }
  std::int64_t integer(std::string_view field, std::int64_t most) const {
    const auto value = parse_integer(field);
    if (!value || *value < 0 || *value > most) {
      fail(shown(field), "a whole number from 0 to " + std::to_string(most));
    }
    return *value;
  }
  std::vector<std::string_view> rest_of(std::string_view line) const {
    std::vector<std::string_view> fields;
    for (auto f = next_field(line); !f.empty(); f = next_field(line)) {
      if (fields.size() == kMostFields) fail("more than 256 fields", "a .pcd header");
      fields.push_back(f);
    }
    return fields;
  }
  void key(std::string_view line) {
    const std::string_view name = next_field(line);
    const auto fields = rest_of(line);
    if (name == "VERSION" || name == "TYPE" || name == "VIEWPOINT") return;
    if (name == "FIELDS" || name == "COLUMNS") {
      for (const auto f : fields) names_.emplace_back(f);
    } else if (name == "SIZE") {
      for (const auto f : fields) sizes_.push_back(integer(f, 8));
    } else if (name == "COUNT") {
      for (const auto f : fields) counts_.push_back(integer(f, 1 << 20));
    } else if (name == "WIDTH" || name == "HEIGHT" || name == "POINTS") {
      const std::int64_t value = integer(fields.empty() ? "" : fields[0], kMostPoints);
      (name == "WIDTH"    ? header_.width
       : name == "HEIGHT" ? header_.height
                          : header_.points) = value;
    } else if (name == "DATA") {
      header_.data = fields.empty() ? "" : std::string(fields[0]);
      if (header_.data != "ascii" && header_.data != "binary" &&
          header_.data != "binary_compressed") {
        fail("DATA " + shown(header_.data), "ascii, binary or binary_compressed");
      }
    } else {
      fail("key " + shown(name), "a .pcd header");
    }
  }
  void check_fields() {
    if (names_.empty() || sizes_.size() != names_.size()) {
      fail(std::to_string(names_.size()) + " FIELDS and " + std::to_string(sizes_.size()) + " SIZE",
           "as many of each");
    }
    if (counts_.empty()) counts_.assign(names_.size(), 1);
    if (counts_.size() != names_.size()) fail("COUNT of another length", "as many as FIELDS");
    int xyz = 0;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      header_.point_bytes += sizes_[i] * counts_[i];
      const bool axis = names_[i] == "x" || names_[i] == "y" || names_[i] == "z";
      if (axis && counts_[i] == 1) ++xyz;
    }
    header_.has_xyz = xyz == 3;
    if (!header_.has_xyz) fail("FIELDS without x y z", "x, y and z");
  }
  void check_size() const {
    if (header_.points == 0) fail("0 points", "at least one point");
    if (header_.width * header_.height != header_.points) {
      fail(std::to_string(header_.points) + " POINTS for WIDTH " + std::to_string(header_.width) +
               " and HEIGHT " + std::to_string(header_.height),
           "their product");
    }
    const auto left = static_cast<std::int64_t>(bytes_.size() - header_.data_begin);
    std::int64_t claimed = header_.points * header_.point_bytes, most = left;
    if (header_.data == "ascii") {
      claimed = header_.points * 2 * static_cast<std::int64_t>(names_.size());
      most = left + 1;  // the last line may lack its end
    }
    if (header_.data == "binary_compressed") {
      std::uint32_t sizes[2] = {0, 0};
      if (left < 8) fail("no compressed data", "two sizes and the data");
      std::memcpy(sizes, bytes_.data() + header_.data_begin, sizeof sizes);
      if (sizes[0] > left - 8) fail("truncated data", std::to_string(sizes[0]) + " bytes");
      if (sizes[1] != claimed) {
        fail(std::to_string(sizes[1]) + " bytes uncompressed", std::to_string(claimed));
      }
      most = (left - 8) * kLzfExpansion;
    }
    if (claimed > most) {
      fail("a claim of " + std::to_string(claimed) + " bytes",
           "at most the file's " + std::to_string(most));
    }
  }

  std::string_view bytes_;
  const std::string& file_;
  LineReader lines_;
  PcdHeader header_;
  std::vector<std::string> names_;
  std::vector<std::int64_t> sizes_, counts_;
};
}  // namespace

PcdHeader check_pcd(std::string_view bytes, const std::string& file) {
  return HeaderReader(bytes, file).read();
}

}  // namespace lamina
