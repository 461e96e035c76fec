// Length and bytes of each item, one after the other.
#include <lamina/io/spool.hpp>

#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

constexpr std::size_t kPending = 1 << 20, kBlock = 1 << 20;
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

Spool::~Spool() {
  if (file_ >= 0) ::close(file_);
}

void Spool::add(std::string_view item) {
  const Length length = item.size();
  pending_.append(reinterpret_cast<const char*>(&length), sizeof length);
  pending_ += item;
  ++count_;
  if (pending_.size() >= kPending) flush();
}

void Spool::clear() {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
  pending_.clear();
  count_ = bytes_ = 0;
}

void Spool::flush() {
  if (file_ < 0) {
    std::string name = (folder_ / ".spool_XXXXXX").string();
    file_ = ::mkstemp(name.data());
    if (file_ < 0)
      throw Error(folder_.string() + ": cannot be written, expected a writable folder");
    ::unlink(name.c_str());
  }
  std::size_t done = 0;
  while (done < pending_.size()) {
    const auto wrote = ::pwrite(file_, pending_.data() + done, pending_.size() - done,
                                static_cast<off_t>(bytes_ + done));
    if (wrote <= 0) throw Error(folder_.string() + ": writing failed, is the disk full?");
    done += static_cast<std::size_t>(wrote);
  }
  bytes_ += pending_.size();
  pending_.clear();
}

void Spool::for_each(const std::function<void(std::string_view)>& take) const {
  std::string bytes, block(kBlock, '\0');
  for (std::uint64_t at = 0; at < bytes_;) {
    const auto got = ::pread(file_, block.data(), kBlock, static_cast<off_t>(at));
    if (got <= 0) throw Error(folder_.string() + ": what was put aside there cannot be read");
    at += static_cast<std::uint64_t>(got);
    bytes.append(block, 0, static_cast<std::size_t>(got));
    take_items(bytes, take);
  }
  bytes += pending_;
  take_items(bytes, take);
  LAMINA_CHECK(bytes.empty());
}

}  // namespace lamina::io
