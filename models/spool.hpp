// A growing list on disk: what a long run must keep but not hold in memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <lamina/models/unnamed_file.hpp>

namespace lamina {

/// Items of bytes in the order they were added, in a file without a name that goes with this
/// object, or with the process however it ends.
class Spool {
 public:
  /// In this folder, made on first need; throws lamina::Error when it cannot be written.
  explicit Spool(std::filesystem::path folder = std::filesystem::temp_directory_path());

  void add(std::string_view item);
  std::uint64_t size() const { return count_; }
  void clear();
  /// Every item, first to last. Throws lamina::Error when reading fails.
  void for_each(const std::function<void(std::string_view)>& take) const;
  /// Called before each item of for_each(); what it throws ends that.
  void before_each(std::function<void()> call) { before_each_ = std::move(call); }

 private:
  void flush();
  std::filesystem::path folder_;
  std::optional<UnnamedFile> file_;
  std::string pending_;  // the list's end, not in the file yet
  std::uint64_t count_ = 0;
  std::function<void()> before_each_;
};

}  // namespace lamina
