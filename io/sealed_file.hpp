// Binary files that tell damage from content: magic, version, size, checksum, then bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace lamina::io {

/// 64-bit FNV-1a of the bytes, going on from `state`.
std::uint64_t checksum(std::string_view bytes, std::uint64_t state = 0xcbf29ce484222325ULL);

/// Eight characters that begin the file, the version of what follows, and what people call it.
struct SealedKind {
  std::string_view magic;  ///< eight characters
  std::uint32_t version = 1;
  std::string_view name;  ///< "a session of `lamina map`"
};

/// Writes whole or not at all (io/atomic_file.hpp).
void write_sealed(const std::filesystem::path& file, const SealedKind& kind,
                  std::string_view content);
/// The same, `write` handing the content over piece by piece.
void write_sealed(
    const std::filesystem::path& file, const SealedKind& kind,
    const std::function<void(const std::function<void(std::string_view)>& put)>& write);
/// The content. Throws lamina::Error with one line for a file that cannot be read, is something
/// else, is of another version, was cut short or is damaged. Nothing is allocated on the word of a
/// header: its size must be the file's.
std::string read_sealed(const std::filesystem::path& file, const SealedKind& kind);

}  // namespace lamina::io
