// What a long run must keep but not hold in memory: bytes in a file that nobody else sees.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace lamina {

/// A file in a folder, without a name: it goes with this object, or with the process however that
/// ends. Bytes are only added to its end.
class UnnamedFile {
 public:
  /// Throws lamina::Error when the folder cannot be written.
  explicit UnnamedFile(std::filesystem::path folder);
  ~UnnamedFile();
  UnnamedFile(const UnnamedFile&) = delete;
  UnnamedFile& operator=(const UnnamedFile&) = delete;

  /// Throws lamina::Error when the disk is full.
  void append(std::string_view bytes);
  std::uint64_t size() const { return size_; }  // bytes
  /// `count` bytes from `at` on; throws lamina::Error when there are fewer.
  std::string read(std::uint64_t at, std::size_t count) const;

 private:
  std::filesystem::path folder_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace lamina
