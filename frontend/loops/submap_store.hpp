// What submaps saw, of a way however long: in memory, or in a file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include <lamina/frontend/motion/submap.hpp>
#include <lamina/models/unnamed_file.hpp>

namespace lamina {

/// Memory that points and fans hold.
std::size_t bytes(const SubmapViews& views);

/// Views of submaps in the order they were completed, bit for bit. In memory, or, once a folder is
/// named, in a file there without a name that goes with the process: a place met again asks for a
/// few of them.
class SubmapStore {
 public:
  /// To be called before the first add().
  void keep_in(const std::filesystem::path& folder);
  /// Throws lamina::Error when the folder cannot be written.
  void add(SubmapViews views);
  std::size_t size() const { return folder_.empty() ? held_.size() : filed_.size(); }
  /// Of the submap that was added as number `index`, from 0. Throws lamina::Error when the file
  /// cannot be read.
  SubmapViews views(std::size_t index) const;
  /// In memory.
  std::size_t bytes() const;

  /// For archives (models/archive.hpp): the same bytes wherever they are.
  template <class A>
  friend void fields(A& a, SubmapStore& v) {
    std::uint64_t count = v.size();
    a(count);
    if constexpr (A::kReading) v.clear();
    for (std::uint64_t i = 0; i < count; ++i) {
      if constexpr (A::kReading) {
        SubmapViews views;
        a(views);
        v.add(std::move(views));
      } else {
        a(v.views(static_cast<std::size_t>(i)));
      }
    }
  }

 private:
  struct Piece {  // of the file
    std::uint64_t at = 0;
    std::size_t size = 0;
  };
  void clear();

  std::filesystem::path folder_;  // empty: in memory
  std::vector<SubmapViews> held_;
  std::unique_ptr<UnnamedFile> file_;
  std::vector<Piece> filed_;
};

}  // namespace lamina
