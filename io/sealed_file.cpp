// Header of 32 bytes: magic 8, version 4, zero 4, content size 8, checksum of the content 8.
#include <lamina/io/sealed_file.hpp>

#include <cstring>
#include <fstream>
#include <ostream>

#include <lamina/io/atomic_file.hpp>
#include <lamina/models/archive.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

constexpr std::size_t kHeader = 32;

}  // namespace

std::uint64_t checksum(std::string_view bytes, std::uint64_t state) {
  for (const char c : bytes) {
    state ^= static_cast<unsigned char>(c);
    state *= 0x100000001b3ULL;
  }
  return state;
}

void write_sealed(const std::filesystem::path& file, const SealedKind& kind,
                  std::string_view content) {
  write_sealed(file, kind,
               [content](const std::function<void(std::string_view)>& put) { put(content); });
}

void write_sealed(
    const std::filesystem::path& file, const SealedKind& kind,
    const std::function<void(const std::function<void(std::string_view)>& put)>& write) {
  LAMINA_CHECK(kind.magic.size() == 8);
  write_atomically(file, [&](std::ostream& out) {
    std::uint64_t size = 0, sum = checksum({});
    out << kind.magic << std::string(kHeader - kind.magic.size(), '\0');
    write([&](std::string_view bytes) {
      size += bytes.size();
      sum = checksum(bytes, sum);
      out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    });
    // Size and sum are known now: the header again, over the empty one.
    ArchiveWriter header;
    header(kind.version, std::uint32_t{0}, size, sum);
    out.seekp(static_cast<std::streamoff>(kind.magic.size()));
    out << header.bytes();
  });
}

std::string read_sealed(const std::filesystem::path& file, const SealedKind& kind) {
  const std::string name = file.string(), expected = "expected " + std::string(kind.name);
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file)) {
    throw Error(name + ": cannot be opened, " + expected);
  }
  std::string header(kHeader, '\0');
  in.read(header.data(), kHeader);
  if (static_cast<std::size_t>(in.gcount()) < 8 || header.substr(0, 8) != kind.magic) {
    throw Error(name + ": found another kind of file, " + expected);
  }
  if (static_cast<std::size_t>(in.gcount()) < kHeader) {
    throw Error(name + ": found " + std::to_string(in.gcount()) + " bytes, " + expected);
  }
  std::uint32_t version = 0, zero = 0;
  std::uint64_t size = 0, sum = 0;
  ArchiveReader reader(std::string_view(header).substr(8));
  reader(version, zero, size, sum);
  if (version != kind.version) {
    throw Error(name + ": found version " + std::to_string(version) + ", expected version " +
                std::to_string(kind.version) + ": it was made by another lamina");
  }
  std::error_code error;
  const std::uint64_t there = std::filesystem::file_size(file, error) - kHeader;
  if (error || there != size) {
    throw Error(name + ": found " + std::to_string(there) + " bytes of content, expected " +
                std::to_string(size) + ": it was cut short");
  }
  std::string content(size, '\0');
  in.read(content.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uint64_t>(in.gcount()) != size || checksum(content) != sum) {
    throw Error(name + ": found damaged content (its checksum differs), " + expected);
  }
  return content;
}

}  // namespace lamina::io
