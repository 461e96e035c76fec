// Unpacks text piece by piece: memory goes with what comes out, up to a limit.
#include <lamina/sensors/readers/compressed_text.hpp>

#include <bzlib.h>
#include <zlib.h>
#include <zstd.h>

#include <array>
#include <fstream>
#include <memory>

#include <lamina/models/error.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {

constexpr std::size_t kPiece = 1 << 16;

// Unpacks one piece after another: `in` is taken from, `out` appended to. False at damage.
class Unpacker {
 public:
  virtual ~Unpacker() = default;
  virtual bool unpack(std::string_view& in, std::string& out) = 0;
  /// The data may end here.
  virtual bool at_end() const = 0;
};

class Gzip final : public Unpacker {
 public:
  Gzip() { inflateInit2(&stream_, 16 + MAX_WBITS); }
  ~Gzip() override { inflateEnd(&stream_); }
  Gzip(const Gzip&) = delete;
  Gzip& operator=(const Gzip&) = delete;
  bool unpack(std::string_view& in, std::string& out) override {
    if (ended_) inflateReset(&stream_);  // members may follow each other
    std::array<unsigned char, kPiece> piece;
    // zlib takes what it reads as not const, and leaves it alone.
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in.data()));
    stream_.avail_in = static_cast<uInt>(in.size());
    stream_.next_out = piece.data();
    stream_.avail_out = static_cast<uInt>(piece.size());
    const int code = inflate(&stream_, Z_NO_FLUSH);
    out.append(reinterpret_cast<const char*>(piece.data()), piece.size() - stream_.avail_out);
    in.remove_prefix(in.size() - stream_.avail_in);
    ended_ = code == Z_STREAM_END;
    return code == Z_OK || ended_ || code == Z_BUF_ERROR;
  }
  bool at_end() const override { return ended_; }

 private:
  z_stream stream_{};
  bool ended_ = false;
};

class Bzip2 final : public Unpacker {
 public:
  Bzip2() { BZ2_bzDecompressInit(&stream_, 0, 0); }
  ~Bzip2() override { BZ2_bzDecompressEnd(&stream_); }
  Bzip2(const Bzip2&) = delete;
  Bzip2& operator=(const Bzip2&) = delete;
  bool unpack(std::string_view& in, std::string& out) override {
    if (ended_) {
      BZ2_bzDecompressEnd(&stream_);
      stream_ = {};
      BZ2_bzDecompressInit(&stream_, 0, 0);
    }
    std::array<char, kPiece> piece;
    stream_.next_in = const_cast<char*>(in.data());
    stream_.avail_in = static_cast<unsigned>(in.size());
    stream_.next_out = piece.data();
    stream_.avail_out = static_cast<unsigned>(piece.size());
    const int code = BZ2_bzDecompress(&stream_);
    out.append(piece.data(), piece.size() - stream_.avail_out);
    in.remove_prefix(in.size() - stream_.avail_in);
    ended_ = code == BZ_STREAM_END;
    return code == BZ_OK || ended_;
  }
  bool at_end() const override { return ended_; }

 private:
  bz_stream stream_{};
  bool ended_ = false;
};

// Frames that ask for a window above the library's own bound (128 MB) are refused by it.
class Zstd final : public Unpacker {
 public:
  bool unpack(std::string_view& in, std::string& out) override {
    std::array<char, kPiece> piece;
    ZSTD_inBuffer from{in.data(), in.size(), 0};
    ZSTD_outBuffer to{piece.data(), piece.size(), 0};
    const std::size_t left = ZSTD_decompressStream(stream_.get(), &to, &from);
    out.append(piece.data(), to.pos);
    in.remove_prefix(from.pos);
    ended_ = left == 0;
    return ZSTD_isError(left) == 0;
  }
  bool at_end() const override { return ended_; }

 private:
  struct Free {
    void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
  };
  std::unique_ptr<ZSTD_DStream, Free> stream_{ZSTD_createDStream()};
  bool ended_ = false;
};

std::unique_ptr<Unpacker> unpacker_for(Compression compression) {
  if (compression == Compression::kGzip) return std::make_unique<Gzip>();
  if (compression == Compression::kBzip2) return std::make_unique<Bzip2>();
  return std::make_unique<Zstd>();
}

// Remembers where the last line began.
class LineCheck {
 public:
  explicit LineCheck(const TextLimits& limits) : limits_(limits) {}
  void check(const std::string& text, const std::filesystem::path& file) {
    const std::size_t end = std::string_view(text).substr(seen_).rfind('\n');
    if (end != std::string_view::npos) line_ = seen_ + end + 1;
    seen_ = text.size();
    if (text.size() - line_ > limits_.longest_line) {
      throw input_error(file.string(), "",
                        "a line of more than " + std::to_string(limits_.longest_line >> 20) + " MB",
                        "the lines of a text log");
    }
    if (text.size() > limits_.largest) {
      throw input_error(file.string(), "",
                        "more than " + std::to_string(limits_.largest >> 20) + " MB of text",
                        "a log up to that size: cut it in pieces");
    }
  }

 private:
  TextLimits limits_;
  std::size_t line_ = 0, seen_ = 0;
};

bool unpack_all(std::string_view& in, Unpacker& unpacker, std::string& text, LineCheck& lines,
                const std::filesystem::path& file) {
  // Unpackers may hold back what did not fit into the last piece: on until nothing moves.
  while (true) {
    const std::size_t before = in.size() + text.size(), had = text.size();
    if (in.empty() && unpacker.at_end()) return true;
    if (!unpacker.unpack(in, text)) return false;
    lines.check(text, file);
    if (in.empty() && text.size() - had < kPiece) return true;
    if (in.size() + text.size() == before && text.size() == had) return false;
  }
}

}  // namespace

Compression compression_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  char magic[4] = {};
  in.read(magic, sizeof magic);
  const std::string_view bytes(magic, static_cast<std::size_t>(in.gcount()));
  if (bytes.substr(0, 2) == "\x1f\x8b") return Compression::kGzip;
  if (bytes.substr(0, 3) == "BZh") return Compression::kBzip2;
  if (bytes == "\x28\xb5\x2f\xfd") return Compression::kZstd;
  return Compression::kNone;
}

TextBytes read_text_bytes(const std::filesystem::path& file, const TextLimits& limits) {
  const Compression compression = compression_of(file);
  if (compression == Compression::kNone) return {read_file_bytes(file), false};
  std::ifstream in(file, std::ios::binary);
  if (!in) throw input_error(file.string(), "", "a file that cannot be opened", "a readable file");
  const auto unpacker = unpacker_for(compression);
  TextBytes result;
  LineCheck lines(limits);
  std::array<char, kPiece> piece;
  while (in.read(piece.data(), piece.size()) || in.gcount() > 0) {
    std::string_view rest(piece.data(), static_cast<std::size_t>(in.gcount()));
    if (unpack_all(rest, *unpacker, result.text, lines, file)) continue;
    result.cut = true;
    return result;
  }
  result.cut = !unpacker->at_end();
  return result;
}

}  // namespace lamina
