// Where every processed frame hangs: a list that grows for as long as a run goes on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include <lamina/backend/graph/graph.hpp>
#include <lamina/models/unnamed_file.hpp>

namespace lamina {

/// A processed frame or scan: where it hangs.
struct MapFrame {
  Timestamp stamp;
  KeyframeId keyframe = KeyframeId::kNone;
  SE3 T_keyframe_body;
};

/// Frames in the order they were added, bit for bit. In memory, or, once a folder is named, all but
/// the newest kBlock of them in a file there without a name that goes with the process. A keyframe
/// that was taken out is a line in a table, so handing its frames over touches none of them. Copies
/// share the file and go on by themselves.
class FrameLog {
 public:
  static constexpr std::size_t kBlock = 1024;

  void keep_in(const std::filesystem::path& folder) { folder_ = folder; }
  /// Throws lamina::Error when the folder cannot be written.
  void add(const MapFrame& frame);
  /// Frames of `from` hang on `into`: T_into_from.
  void transfer(KeyframeId from, KeyframeId into, const SE3& T_into_from);
  std::size_t size() const { return size_; }
  void for_each(const std::function<void(const MapFrame&)>& take) const;

 private:
  struct Block {  // of the file
    std::uint64_t at = 0;
    std::size_t size = 0, frames = 0;
  };
  struct Successor {
    KeyframeId into;
    SE3 T_into_from;
  };
  MapFrame resolved(MapFrame frame) const;
  void spill();

  std::filesystem::path folder_;  // empty: in memory
  std::vector<MapFrame> newest_;
  std::shared_ptr<UnnamedFile> file_;
  std::vector<Block> blocks_;
  std::map<KeyframeId, Successor> successors_;
  std::size_t size_ = 0;
};

}  // namespace lamina
