// Small helpers of the text readers: lines, fields, exact numbers, nearest names.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lamina {

/// The bytes of a file. Throws lamina::Error when it is absent, a folder, or unreadable. Reads what
/// the file holds, never what a header inside claims.
std::string read_file_bytes(const std::filesystem::path& file);

/// The next field up to blanks (space, tab, CR); advances `rest`; empty at the end.
std::string_view next_field(std::string_view& rest);

/// A finite decimal number that fills the field; nullopt otherwise ("nan" and "inf" are none).
std::optional<double> parse_number(std::string_view field);
/// As parse_number, and "nan", "inf", "-inf" in any case are read as such.
std::optional<double> parse_number_or_special(std::string_view field);
std::optional<std::int64_t> parse_integer(std::string_view field);

/// Lines of a text without their ends; yields line numbers from 1.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : rest_(text) {}
  /// False at the end. A last line without an end counts.
  bool next(std::string_view& line);
  int number() const { return number_; }

 private:
  std::string_view rest_;
  int number_ = 0;
};

/// True for an empty line or one that starts with '#' after blanks.
bool is_comment(std::string_view line);

/// The candidate with the least edit distance to `name`; empty when there are none.
std::string nearest_name(std::string_view name, std::span<const std::string_view> candidates);

/// At most 40 characters of `text`, unprintable ones replaced: for messages.
std::string shown(std::string_view text);

}  // namespace lamina
