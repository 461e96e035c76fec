// Records, chunks, indices and summary [MCAP].
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <fstream>
#include <limits>
#include <map>
#include <vector>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/mcap_blocks.hpp>
#include <lamina/sensors/ros2/record_writer.hpp>

namespace lamina::ros2 {
namespace {
std::string number(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i) & 255u);
  return text;
}

std::string text_of(std::string_view text) { return number(text.size(), 4) + std::string(text); }

std::string record(std::uint8_t opcode, std::string_view content) {
  return number(opcode, 1) + number(content.size(), 8) + std::string(content);
}

std::uint32_t crc_of(std::string_view bytes) {
  const void* data = bytes.data();
  return static_cast<std::uint32_t>(crc32_z(0, static_cast<const Bytef*>(data), bytes.size()));
}

std::string packed(std::string_view bytes, const std::string& compression) {
  if (compression.empty()) return std::string(bytes);
  const bool lz4 = compression == "lz4";
  std::string out(
      lz4 ? LZ4F_compressFrameBound(bytes.size(), nullptr) : ZSTD_compressBound(bytes.size()),
      '\0');
  const std::size_t size =
      lz4 ? LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr)
          : ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 1);
  LAMINA_CHECK(size <= out.size());
  out.resize(size);
  return out;
}

class McapWriter final : public RecordWriter {
 public:
  McapWriter(const std::filesystem::path& file, McapWriterOptions options)
      : name_(file.string()), options_(std::move(options)), out_(file, std::ios::binary) {
    put("\x89MCAP0\r\n");
    put(record(mcap::kHeader, text_of("ros2") + text_of("lamina")));
  }

  void add_topic(const std::string& name, const std::string& type) override {
    const auto id = static_cast<std::uint64_t>(counts_.size()) + 1;
    const std::string channel =
        record(mcap::kSchema, number(id, 2) + text_of(type) + text_of("ros2msg") + text_of("")) +
        record(mcap::kChannel,
               number(id, 2) + number(id, 2) + text_of(name) + text_of("cdr") + text_of(""));
    channels_ += channel;
    counts_.push_back(0);
    if (options_.chunk == 0) put(channel);
    if (options_.chunk > 0) chunk_ += channel;
  }

  void write(std::size_t topic, std::int64_t log_ns, std::string_view bytes) override {
    const auto time = static_cast<std::uint64_t>(log_ns);
    const std::uint64_t id = topic + 1;
    const std::string message = record(
        mcap::kMessage, number(id, 2) + number(static_cast<std::uint64_t>(counts_[topic]++), 4) +
                            number(time, 8) + number(time, 8) + std::string(bytes));
    first_ = std::min(first_, time);
    last_ = std::max(last_, time);
    if (options_.chunk == 0) return put(message);
    chunk_first_ = std::min(chunk_first_, time);
    chunk_last_ = std::max(chunk_last_, time);
    index_[id] += number(time, 8) + number(chunk_.size(), 8);
    chunk_ += message;
    if (chunk_.size() >= options_.chunk) finish_chunk();
  }

  void close() override {
    if (!chunk_.empty()) finish_chunk();
    put(record(mcap::kDataEnd, number(0, 4)));
    const std::uint64_t summary = at_;
    if (options_.summary) {
      put(channels_);
      put(chunk_indices_);
      put(record(mcap::kStatistics, statistics()));
    }
    put(record(mcap::kFooter,
               number(options_.summary ? summary : 0, 8) + number(0, 8) + number(0, 4)));
    put("\x89MCAP0\r\n");
    out_.close();
    if (!out_) fail();
  }

 private:
  [[noreturn]] void fail() const {
    throw input_error(name_, "", "a file that cannot be written", "a writable folder with room");
  }
  void put(std::string_view bytes) {
    out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!out_) fail();
    at_ += bytes.size();
  }

  void finish_chunk() {
    if (chunk_last_ == 0 && chunk_first_ == never()) chunk_first_ = 0;
    const std::uint64_t begin = at_;
    const std::string body = packed(chunk_, options_.compression);
    const std::string head = number(chunk_first_, 8) + number(chunk_last_, 8) +
                             number(chunk_.size(), 8) + number(crc_of(chunk_), 4) +
                             text_of(options_.compression) + number(body.size(), 8);
    put(record(mcap::kChunk, head + body));
    const std::uint64_t size = at_ - begin;
    std::string offsets;
    for (const auto& [id, entries] : index_) {
      offsets += number(id, 2) + number(at_, 8);
      if (options_.indices) put(record(mcap::kMessageIndex, number(id, 2) + text_of(entries)));
    }
    if (options_.indices)
      chunk_indices_ += record(mcap::kChunkIndex,
                               number(chunk_first_, 8) + number(chunk_last_, 8) + number(begin, 8) +
                                   number(size, 8) + text_of(offsets) +
                                   number(at_ - begin - size, 8) + text_of(options_.compression) +
                                   number(body.size(), 8) + number(chunk_.size(), 8));
    ++chunks_;
    chunk_.clear();
    index_.clear();
    chunk_first_ = never();
    chunk_last_ = 0;
  }

  std::string statistics() const {
    std::uint64_t all = 0;
    std::string by_channel;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      const auto count = static_cast<std::uint64_t>(counts_[i]);
      all += count;
      by_channel += number(i + 1, 2) + number(count, 8);
    }
    return number(all, 8) + number(counts_.size(), 2) + number(counts_.size(), 4) + number(0, 4) +
           number(0, 4) + number(chunks_, 4) + number(all > 0 ? first_ : 0, 8) + number(last_, 8) +
           text_of(by_channel);
  }

  static std::uint64_t never() { return std::numeric_limits<std::uint64_t>::max(); }
  std::string name_;
  McapWriterOptions options_;
  std::ofstream out_;
  std::uint64_t at_ = 0, first_ = never(), last_ = 0, chunk_first_ = never(), chunk_last_ = 0;
  std::string chunk_, channels_, chunk_indices_;
  std::map<std::uint64_t, std::string> index_;  // by channel, of the open chunk
  std::vector<std::int64_t> counts_;            // messages by topic
  std::uint64_t chunks_ = 0;
};

}  // namespace

std::unique_ptr<RecordWriter> make_mcap_writer(const std::filesystem::path& file,
                                               const McapWriterOptions& options) {
  return std::make_unique<McapWriter>(file, options);
}

}  // namespace lamina::ros2
