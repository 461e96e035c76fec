// POSIX: made, opened and taken out of its folder at once.
#include <lamina/models/unnamed_file.hpp>

#include <unistd.h>

#include <cstdlib>

#include <lamina/models/error.hpp>

namespace lamina {

UnnamedFile::UnnamedFile(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::string name = (folder_ / ".lamina_XXXXXX").string();
  descriptor_ = ::mkstemp(name.data());
  if (descriptor_ < 0)
    throw Error(folder_.string() + ": cannot be written, expected a writable folder");
  ::unlink(name.c_str());
}

UnnamedFile::~UnnamedFile() { ::close(descriptor_); }

void UnnamedFile::append(std::string_view bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const auto wrote = ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done,
                                static_cast<off_t>(size_ + done));
    if (wrote <= 0) throw Error(folder_.string() + ": writing failed, is the disk full?");
    done += static_cast<std::size_t>(wrote);
  }
  size_ += bytes.size();
}

std::string UnnamedFile::read(std::uint64_t at, std::size_t count) const {
  std::string bytes(count, '\0');
  std::size_t done = 0;
  while (done < count) {
    const auto got =
        ::pread(descriptor_, bytes.data() + done, count - done, static_cast<off_t>(at + done));
    if (got <= 0) throw Error(folder_.string() + ": what was put aside there cannot be read");
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

}  // namespace lamina
