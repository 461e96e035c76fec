// Blocks of frames in memory and on file.
#include <lamina/backend/mapper/frame_log.hpp>

#include <string>

#include <lamina/backend/mapper/map_archive.hpp>

namespace lamina {

void FrameLog::add(const MapFrame& frame) {
  newest_.push_back(frame);
  ++size_;
  if (!folder_.empty() && newest_.size() >= kBlock) spill();
}

void FrameLog::spill() {
  if (!file_) file_ = std::make_shared<UnnamedFile>(folder_);
  ArchiveWriter archive;
  for (const MapFrame& frame : newest_) archive(frame);
  blocks_.push_back({file_->size(), archive.bytes().size(), newest_.size()});
  file_->append(archive.bytes());
  newest_.clear();
}

void FrameLog::transfer(KeyframeId from, KeyframeId into, const SE3& T_into_from) {
  if (from != into) successors_.emplace(from, Successor{into, T_into_from});
}

// By each keyframe that was taken out in turn: an heir is there when it inherits, so this ends.
MapFrame FrameLog::resolved(MapFrame frame) const {
  for (auto it = successors_.find(frame.keyframe); it != successors_.end();
       it = successors_.find(frame.keyframe)) {
    frame.keyframe = it->second.into;
    frame.T_keyframe_body = it->second.T_into_from * frame.T_keyframe_body;
  }
  return frame;
}

void FrameLog::for_each(const std::function<void(const MapFrame&)>& take) const {
  for (const Block& block : blocks_) {
    const std::string bytes = file_->read(block.at, block.size);
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
