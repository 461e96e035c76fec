// Text files as they are or compressed by gzip, bzip2 or Zstandard.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace lamina {

enum class Compression { kNone, kGzip, kBzip2, kZstd };

/// By the file's first bytes, whatever its name says. kNone where it cannot be read.
Compression compression_of(const std::filesystem::path& file);

struct TextBytes {
  std::string text;
  bool cut = false;  ///< the compressed data end too early or are damaged; `text` is what was good
};

struct TextLimits {
  /// Bytes after unpacking: some 50 hours of a scanner's log. More is no log, or must be cut.
  std::size_t largest = std::size_t{2} << 30;
  /// Bytes without an end of line: no log has lines as long.
  std::size_t longest_line = std::size_t{16} << 20;
};

/// What a text file holds, unpacked where it is compressed. Reads what is there, never what a
/// header claims. Throws lamina::Error when it is absent, unreadable, or beyond the limits.
TextBytes read_text_bytes(const std::filesystem::path& file, const TextLimits& limits = {});

}  // namespace lamina
