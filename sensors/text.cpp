// Lines, fields, exact numbers, nearest names.
#include <lamina/sensors/text.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return result;
}
}  // namespace

std::string read_file_bytes(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) {
    throw input_error(file.string(), "", "no such file", "a readable file");
  }
  if (std::filesystem::is_directory(status)) {
    throw input_error(file.string(), "", "a folder", "a file");
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) throw input_error(file.string(), "", "a file that cannot be opened", "a readable file");
  std::string bytes;
  char buffer[1 << 16];
  while (in.read(buffer, sizeof buffer) || in.gcount() > 0) {
    bytes.append(buffer, static_cast<std::size_t>(in.gcount()));
  }
  return bytes;
}

std::string_view next_field(std::string_view& rest) {
  std::size_t begin = 0;
  while (begin < rest.size() && is_blank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !is_blank(rest[end])) ++end;
  const std::string_view field = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return field;
}

std::optional<double> parse_number(std::string_view field) {
  if (!field.empty() && field.front() == '+') field.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error == std::errc::result_out_of_range && end == field.data() + field.size()) {
    // Too small to tell from zero, or too large to be anything: the exponent's sign tells.
    const std::size_t exponent = field.find_first_of("eE");
    const bool small = exponent == std::string_view::npos
                           ? field.substr(0, 2) == "0." || field.substr(0, 3) == "-0."
                           : field.substr(exponent + 1, 1) == "-";
    return small ? std::optional<double>(0.0) : std::nullopt;
  }
  if (error != std::errc() || end != field.data() + field.size()) return std::nullopt;
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<double> parse_number_or_special(std::string_view field) {
  if (const auto value = parse_number(field)) return value;
  if (field.size() > 9) return std::nullopt;
  const std::string text = lower(field);
  if (text == "nan" || text == "-nan") return std::nan("");
  if (text == "inf" || text == "+inf" || text == "infinity") return HUGE_VAL;
  if (text == "-inf") return -HUGE_VAL;
  return std::nullopt;
}

std::optional<std::int64_t> parse_integer(std::string_view field) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || end != field.data() + field.size()) return std::nullopt;
  return value;
}

bool LineReader::next(std::string_view& line) {
  if (rest_.empty()) return false;
  const std::size_t end = rest_.find('\n');
  line = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  ++number_;
  return true;
}

bool is_comment(std::string_view line) {
  const std::string_view first = next_field(line);
  return first.empty() || first.front() == '#';
}

std::string nearest_name(std::string_view name, std::span<const std::string_view> candidates) {
  std::string best;
  std::size_t best_distance = 0;
  for (const std::string_view candidate : candidates) {
    std::vector<std::size_t> row(candidate.size() + 1);
    for (std::size_t j = 0; j < row.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= name.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i;
      for (std::size_t j = 1; j < row.size(); ++j) {
        const std::size_t change = diagonal + (name[i - 1] == candidate[j - 1] ? 0 : 1);
        diagonal = row[j];
        row[j] = std::min({change, row[j] + 1, row[j - 1] + 1});
      }
    }
    if (best.empty() || row.back() < best_distance) {
      best = std::string(candidate);
      best_distance = row.back();
    }
  }
  return best;
}

std::string shown(std::string_view text) {
  std::string result = "'";
  for (const char c : text.substr(0, 40)) result += (c >= 32 && c < 127) ? c : '?';
  if (text.size() > 40) result += "...";
  return result + "'";
}

}  // namespace lamina
