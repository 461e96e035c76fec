// Views as archives, one behind the other.
#include <lamina/frontend/loops/submap_store.hpp>

#include <string>

#include <lamina/models/error.hpp>
#include <lamina/models/model_archive.hpp>

namespace lamina {

std::size_t bytes(const SubmapViews& views) {
  std::size_t sum =
      views.points.capacity() * sizeof(OrientedPoint) + views.fans.capacity() * sizeof(SightFan);
  for (const SightFan& fan : views.fans) sum += fan.nearest.capacity() * sizeof(float);
  return sum;
}

void SubmapStore::keep_in(const std::filesystem::path& folder) {
  LAMINA_CHECK(size() == 0);
  folder_ = folder;
}

void SubmapStore::add(SubmapViews views) {
  if (folder_.empty()) {
    held_.push_back(std::move(views));
    return;
  }
  if (!file_) file_ = std::make_unique<UnnamedFile>(folder_);
  ArchiveWriter archive;
  archive(views);
  const Piece piece{file_->size(), archive.bytes().size()};
  file_->append(archive.bytes());
  filed_.push_back(piece);
}

SubmapViews SubmapStore::views(std::size_t index) const {
  if (folder_.empty()) return held_.at(index);
  const Piece& piece = filed_.at(index);
  const std::string content = file_->read(piece.at, piece.size);
  SubmapViews views;
  ArchiveReader archive(content);
  archive(views);
  return views;
}

std::size_t SubmapStore::bytes() const {
  std::size_t sum = held_.capacity() * sizeof(SubmapViews) + filed_.capacity() * sizeof(Piece);
  for (const SubmapViews& views : held_) sum += lamina::bytes(views);
  return sum;
}

void SubmapStore::clear() {
  held_.clear();
  filed_.clear();
  file_.reset();
}

}  // namespace lamina
