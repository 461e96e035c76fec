// Streaming interfaces of both libraries.
#include <lamina/sensors/ros2/unpack.hpp>

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>

#include <lamina/models/error.hpp>

namespace lamina::ros2 {
namespace {
enum : std::size_t { kPiece = std::size_t{1} << 16 };  // bytes

struct FreeZstd {
  void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
};
struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};

// `take` gets each piece and may refuse it. Streams go on over several calls.
class ZstdStream {
 public:
  template <class Take>
  bool feed(std::string_view packed, const Take& take) {
    ZSTD_inBuffer from{packed.data(), packed.size(), 0};
    bool more = true;
    while (from.pos < from.size || more) {
      ZSTD_outBuffer to{piece_.data(), piece_.size(), 0};
      left_ = ZSTD_decompressStream(stream_.get(), &to, &from);
      if (ZSTD_isError(left_) != 0 || !take(std::string_view(piece_.data(), to.pos))) return false;
      more = to.pos == to.size;
    }
    return true;
  }
  bool at_end() const { return left_ == 0; }

 private:
  std::unique_ptr<ZSTD_DStream, FreeZstd> stream_{ZSTD_createDStream()};
  std::array<char, kPiece> piece_;
  std::size_t left_ = 1;
};

}  // namespace

bool is_zstd(std::string_view bytes) { return bytes.substr(0, 4) == "\x28\xb5\x2f\xfd"; }

bool unpack_zstd(std::string_view packed, std::size_t most, std::string& out) {
  const auto stream = std::make_unique<ZstdStream>();
  return stream->feed(packed, [&](std::string_view piece) {
    if (piece.size() > most - std::min(most, out.size())) return false;
    out.append(piece);
    return true;
  }) && stream->at_end();
}

bool unpack_lz4(std::string_view packed, std::size_t most, std::string& out) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) return false;
  const std::unique_ptr<LZ4F_dctx, FreeLz4> context(made);
  std::string piece(kPiece, '\0');
  std::size_t left = 1;
  while (true) {
    std::size_t written = piece.size(), taken = packed.size();
    left = LZ4F_decompress(context.get(), piece.data(), &written, packed.data(), &taken, nullptr);
    if (LZ4F_isError(left) != 0) return false;
    if (written > most - std::min(most, out.size())) return false;
    out.append(piece, 0, written);
    packed.remove_prefix(taken);
    if (packed.empty() && written < piece.size()) return left == 0;
    if (taken == 0 && written == 0) return false;
  }
}

bool unpack_zstd_file(const std::filesystem::path& file, const std::filesystem::path& out) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw input_error(file.string(), "", "a file that cannot be opened", "a readable file");
  std::ofstream plain(out, std::ios::binary);
  const auto stream = std::make_unique<ZstdStream>();
  std::string packed(kPiece, '\0');
  bool good = true;
  while (good &&
         (in.read(packed.data(), static_cast<std::streamsize>(packed.size())) || in.gcount() > 0)) {
    const std::string_view rest(packed.data(), static_cast<std::size_t>(in.gcount()));
    good = stream->feed(rest, [&](std::string_view piece) {
      plain.write(piece.data(), static_cast<std::streamsize>(piece.size()));
      return plain.good();
    });
    if (!plain) break;
  }
  if (!plain.flush())
    throw input_error(out.string(), "", "no room to unpack " + file.string(),
                      "a disk with room (TMPDIR names its folder)");
  return good && stream->at_end();
}

}  // namespace lamina::ros2
