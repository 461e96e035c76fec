// Headers of .pcd files, checked before the library believes them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lamina {

/// What a .pcd header claims, and where its data begin.
struct PcdHeader {
  std::int64_t width = 0, height = 0, points = 0;
  std::int64_t point_bytes = 0;  ///< sum of SIZE x COUNT
  std::string data;              ///< ascii, binary or binary_compressed
  std::size_t data_begin = 0;    ///< bytes
  bool has_xyz = false;
};

/// Reads the header and proves that the file can hold what it claims: a claim of ten gigabytes in
/// a short file is an error here, before anything is allocated. Throws lamina::Error naming `file`
/// and the line. `bytes` is the whole file.
PcdHeader check_pcd(std::string_view bytes, const std::string& file);

}  // namespace lamina
