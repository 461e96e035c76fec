// Where the messages of an MCAP file lie: its records, walked from the first to the last [MCAP].
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <lamina/sensors/ros2/storage.hpp>

namespace lamina::ros2 {

/// A file read at any place; it stays open.
class PlacedFile {
 public:
  /// Throws lamina::Error when it cannot be read.
  explicit PlacedFile(const std::filesystem::path& file);
  ~PlacedFile();
  PlacedFile(const PlacedFile&) = delete;
  PlacedFile& operator=(const PlacedFile&) = delete;
  std::uint64_t size() const { return size_; }  // bytes
  /// Up to `count` bytes from `at` on: fewer at the end.
  std::string read(std::uint64_t at, std::uint64_t count) const;

 private:
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// A chunk, or records that follow each other without one.
struct McapBlock {
  std::uint64_t at = 0, size = 0;               ///< bytes of the file
  std::string compression;                      ///< "", "lz4", "zstd"
  std::uint32_t crc = 0;                        ///< of the unpacked bytes; 0: not stated
  std::uint64_t start_ns = 0;                   ///< of its first message, as claimed
  std::optional<std::set<std::size_t>> topics;  ///< of its messages, once they were read
  bool cut = false;                             ///< the file ends within it
};

/// What schemas and channels say, wherever they stand.
class McapChannels {
 public:
  /// The content of a record with this opcode; others are passed over. False when it is damaged.
  bool read(std::uint8_t opcode, std::string_view content);
  /// The topic of a channel; nullopt of one that no record tells.
  std::optional<std::size_t> topic_of(std::uint16_t channel) const;
  void count(std::uint16_t channel, std::int64_t messages);
  const std::vector<StoredTopic>& topics() const { return topics_; }

 private:
  bool read_channel(std::string_view content);

  std::map<std::uint16_t, std::string> schemas_;     // id -> name
  std::map<std::uint16_t, std::size_t> by_channel_;  // -> index of topics_
  std::vector<StoredTopic> topics_;
};

struct McapLayout {
  std::vector<McapBlock> blocks;                 ///< in the order of the file
  std::map<std::uint16_t, std::int64_t> counts;  ///< of messages by channel, if stated
  bool whole = false;                            ///< up to the closing record, and counted
  std::string problem;                           ///< why the walk ended early
};

struct McapWalkOptions {
  std::uint64_t run = 1u << 20;            ///< bytes of records outside of chunks, read at once
  std::uint64_t largest_small = 1u << 24;  ///< bytes of a schema, a channel, statistics
  std::uint64_t most_head = 4096;  ///< bytes of a chunk's numbers and the name of its compression
};

/// Walks over a file that begins as MCAP does. What stands after the first record that is damaged
/// or goes beyond the end of the file is not read. Channels outside of chunks go to `channels`.
McapLayout walk_mcap(const PlacedFile& file, McapChannels& channels,
                     const McapWalkOptions& options = {});

/// The records in a text of them: opcode and content, up to the first that is not whole.
class McapRecords {
 public:
  explicit McapRecords(std::string_view bytes) : bytes_(bytes) {}
  struct Record {
    std::uint8_t opcode = 0;
    std::string_view content;
  };
  std::optional<Record> next();
  /// All that was there was whole records.
  bool at_end() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
};

/// The fields of a record in their order. A read beyond its end gives 0 or "" and makes it bad.
class McapFields {
 public:
  explicit McapFields(std::string_view bytes) : rest_(bytes) {}
  std::uint64_t number(std::size_t bytes);
  std::string_view text() { return take(number(4)); }
  std::string_view take(std::uint64_t bytes);
  std::string_view rest() const { return rest_; }
  bool good() const { return good_; }

 private:
  std::string_view rest_;
  bool good_ = true;
};

namespace mcap {
enum Opcode : std::uint8_t {
  kHeader = 1,
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kMessageIndex = 7,
  kChunkIndex = 8,
  kStatistics = 11,
  kDataEnd = 15
};
}  // namespace mcap

}  // namespace lamina::ros2
