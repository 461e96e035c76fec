// Blocks of frames in memory and on file.
#include <lamina/backend/frame_log.hpp>

#include <unistd.h>

#include <cstdlib>
#include <string>

#include <lamina/backend/map_archive.hpp>
#include <lamina/models/error.hpp>

namespace lamina {

struct FrameLog::File {
  std::filesystem::path folder;
  int descriptor = -1;
  std::uint64_t size = 0;

  explicit File(const std::filesystem::path& in) : folder(in) {
    std::string name = (folder / ".frames_XXXXXX").string();
    descriptor = ::mkstemp(name.data());
    if (descriptor < 0)
      throw Error(folder.string() + ": cannot be written, expected a writable folder");
    ::unlink(name.c_str());
  }
  ~File() { ::close(descriptor); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void append(const std::string& bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
      const auto wrote = ::pwrite(descriptor, bytes.data() + done, bytes.size() - done,
                                  static_cast<off_t>(size + done));
      if (wrote <= 0) throw Error(folder.string() + ": writing failed, is the disk full?");
      done += static_cast<std::size_t>(wrote);
    }
    size += bytes.size();
  }
  std::string read(const Block& block) const {
    std::string bytes(block.size, '\0');
    std::size_t done = 0;
    while (done < bytes.size()) {
      const auto got = ::pread(descriptor, bytes.data() + done, bytes.size() - done,
                               static_cast<off_t>(block.at + done));
      if (got <= 0) throw Error(folder.string() + ": what was put aside there cannot be read");
      done += static_cast<std::size_t>(got);
    }
    return bytes;
  }
};

void FrameLog::add(const MapFrame& frame) {
  newest_.push_back(frame);
  ++size_;
  if (!folder_.empty() && newest_.size() >= kBlock) spill();
}

void FrameLog::spill() {
  if (!file_) file_ = std::make_shared<File>(folder_);
  ArchiveWriter archive;
  for (const MapFrame& frame : newest_) archive(frame);
  blocks_.push_back({file_->size, archive.bytes().size(), newest_.size()});
  file_->append(archive.bytes());
  newest_.clear();
}

void FrameLog::hand_over(KeyframeId from, KeyframeId into, const SE3& T_into_from) {
  if (from != into) heirs_.emplace(from, Heir{into, T_into_from});
}

// By each keyframe that was taken out in turn: an heir is there when it inherits, so this ends.
MapFrame FrameLog::resolved(MapFrame frame) const {
  for (auto it = heirs_.find(frame.keyframe); it != heirs_.end();
       it = heirs_.find(frame.keyframe)) {
    frame.keyframe = it->second.into;
    frame.T_keyframe_body = it->second.T_into_from * frame.T_keyframe_body;
  }
  return frame;
}

void FrameLog::for_each(const std::function<void(const MapFrame&)>& take) const {
  for (const Block& block : blocks_) {
    const std::string bytes = file_->read(block);
    ArchiveReader archive(bytes);
    for (std::size_t i = 0; i < block.frames; ++i) {
      MapFrame frame;
      archive(frame);
      take(resolved(frame));
    }
  }
  for (const MapFrame& frame : newest_) take(resolved(frame));
}

}  // namespace lamina
