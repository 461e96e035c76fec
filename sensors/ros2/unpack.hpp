// Zstandard and LZ4 within bounds: never more memory than what the bytes really hold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace lamina::ros2 {

/// Appends to `out` what the frames in `packed` hold, up to `most` bytes. False when they are cut,
/// damaged or hold more; `out` then has what was good before that.
bool unpack_zstd(std::string_view packed, std::size_t most, std::string& out);
bool unpack_lz4(std::string_view packed, std::size_t most, std::string& out);

/// Begins as a frame of Zstandard does, which no message in CDR does.
bool is_zstd(std::string_view bytes);

/// Writes what a .zstd file holds to `out`. False when it is cut or damaged. Throws lamina::Error
/// when it cannot be read or the disk is full.
bool unpack_zstd_file(const std::filesystem::path& file, const std::filesystem::path& out);

}  // namespace lamina::ros2
