// Length and bytes of each item, one after the other.
#include <lamina/models/spool.hpp>

#include <algorithm>
#include <cstring>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

constexpr std::size_t kPending = 1 << 18, kBlock = 1 << 20;
using Length = std::uint64_t;

// Takes whole items off the front of `bytes`.
void take_items(std::string& bytes, const std::function<void(std::string_view)>& take) {
  std::size_t at = 0;
  while (bytes.size() - at >= sizeof(Length)) {
    Length length = 0;
    std::memcpy(&length, bytes.data() + at, sizeof length);
    if (bytes.size() - at - sizeof length < length) break;
    take(std::string_view(bytes).substr(at + sizeof length, length));
    at += sizeof length + length;
  }
  bytes.erase(0, at);
}

}  // namespace

Spool::Spool(std::filesystem::path folder) : folder_(std::move(folder)) {}

void Spool::add(std::string_view item) {
  const Length length = item.size();
  pending_.append(reinterpret_cast<const char*>(&length), sizeof length);
  pending_ += item;
  ++count_;
  if (pending_.size() >= kPending) flush();
}

void Spool::clear() {
  file_.reset();
  pending_.clear();
  count_ = 0;
}

void Spool::flush() {
  if (!file_) file_.emplace(folder_);
  file_->append(pending_);
  pending_.clear();
}

void Spool::for_each(const std::function<void(std::string_view)>& take) const {
  std::string bytes;
  const auto each = [this, &take](std::string_view item) {
    if (before_each_) before_each_();
    take(item);
  };
  const std::uint64_t size = file_ ? file_->size() : 0;
  for (std::uint64_t at = 0; at < size;) {
    const std::string block = file_->read(at, std::min<std::uint64_t>(kBlock, size - at));
    at += block.size();
    bytes += block;
    take_items(bytes, each);
  }
  bytes += pending_;
  take_items(bytes, each);
  LAMINA_CHECK(bytes.empty());
}

}  // namespace lamina
