// Hops from record to record; reads no more of each than it needs.
#include <lamina/sensors/ros2/mcap_blocks.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include <lamina/models/error.hpp>

namespace lamina::ros2 {
namespace {
enum : std::uint64_t { kHead = 9 };  // bytes of opcode and length

class Walk {
 public:
  Walk(const PlacedFile& file, McapChannels& channels, const McapWalkOptions& options)
      : file_(file), channels_(channels), options_(options) {}
  McapLayout result() {
    while (step()) {
    }
    layout_.whole = layout_.problem.empty() && ended_ && counted_;
    return std::move(layout_);
  }

 private:
  // False at the end of the file, or of what can be read.
  bool step() {
    const std::string head = file_.read(at_, kHead);
    if (head.empty()) return stop(ended_ ? "" : "it ends without its closing record");
    if (head == "\x89MCAP0\r\n") return false;
    if (head.size() < kHead) return is_magic(head) ? false : stop("it ends within a record");
    if (is_magic(head)) return false;
    McapFields fields(head);
    const auto opcode = static_cast<std::uint8_t>(fields.number(1));
    const std::uint64_t size = fields.number(8), begin = at_ + kHead;
    const std::uint64_t left = file_.size() - begin;
    if (opcode == 0) return stop("a record of no kind");
    const bool cut = size > left;
    if (opcode == mcap::kChunk) chunk(begin, std::min(size, left), cut);
    if (cut) return stop("it ends within a record");
    if (opcode == mcap::kDataEnd) ended_ = true;
    if (opcode == mcap::kSchema || opcode == mcap::kChannel || opcode == mcap::kStatistics)
      small(opcode, begin, size);
    if (opcode == mcap::kMessage) message(begin, size);
    at_ = begin + size;
    return true;
  }

  static bool is_magic(const std::string& head) {
    return head.size() >= 8 && head.compare(0, 8, "\x89MCAP0\r\n") == 0;
  }

  bool stop(const std::string& why) {
    if (!why.empty()) layout_.problem = "at byte " + std::to_string(at_) + ": " + why;
    return false;
  }

  void chunk(std::uint64_t begin, std::uint64_t size, bool cut) {
    const std::string head = file_.read(begin, std::min(size, options_.most_head));
    McapFields fields(head);
    McapBlock block;
    block.start_ns = fields.number(8);
    fields.number(8);
    fields.number(8);
    block.crc = static_cast<std::uint32_t>(fields.number(4));
    block.compression = printable(std::string(fields.text()));
    const std::uint64_t packed = fields.number(8);
    if (!fields.good()) return;
    const std::uint64_t used = head.size() - fields.rest().size();
    block.at = begin + used;
    block.size = std::min(packed, size - used);
    block.cut = cut || packed > size - used;
    layout_.blocks.push_back(block);
  }

  void small(std::uint8_t opcode, std::uint64_t begin, std::uint64_t size) {
    if (size > options_.largest_small) return;
    const std::string content = file_.read(begin, size);
    if (opcode != mcap::kStatistics) {
      channels_.read(opcode, content);
      return;
    }
    McapFields fields(content);
    for (const std::size_t bytes : {8u, 2u, 4u, 4u, 4u, 4u, 8u, 8u}) fields.number(bytes);
    McapFields map(fields.text());
    while (map.good() && !map.rest().empty()) {
      const auto channel = static_cast<std::uint16_t>(map.number(2));
      layout_.counts[channel] = static_cast<std::int64_t>(map.number(8));
    }
    counted_ = fields.good() && map.good();
  }

  void message(std::uint64_t begin, std::uint64_t size) {
    const std::uint64_t at = begin - kHead;
    auto& blocks = layout_.blocks;
    const bool goes_on = run_open_ && !blocks.empty() &&
                         blocks.back().at + blocks.back().size == at &&
                         blocks.back().size < options_.run;
    if (!goes_on) {
      const std::string head = file_.read(begin, 14);
      McapFields fields(head);
      fields.number(2);
      fields.number(4);
      McapBlock block;
      block.at = at;
      block.start_ns = fields.number(8);
      blocks.push_back(block);
      run_open_ = true;
    }
    blocks.back().size += kHead + size;
  }

  const PlacedFile& file_;
  McapChannels& channels_;
  McapWalkOptions options_;
  McapLayout layout_;
  std::uint64_t at_ = 8;
  bool ended_ = false, counted_ = false, run_open_ = false;
};

}  // namespace

PlacedFile::PlacedFile(const std::filesystem::path& file)
    : descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
  struct stat status {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) {
    if (descriptor_ >= 0) ::close(descriptor_);
    throw input_error(file.string(), "", "a file that cannot be opened", "a readable file");
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

PlacedFile::~PlacedFile() { ::close(descriptor_); }

std::string PlacedFile::read(std::uint64_t at, std::uint64_t count) const {
  if (at >= size_) return {};
  std::string bytes(std::min(count, size_ - at), '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const auto got = ::pread(descriptor_, bytes.data() + done, bytes.size() - done,
                             static_cast<off_t>(at + done));
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

McapLayout walk_mcap(const PlacedFile& file, McapChannels& channels,
                     const McapWalkOptions& options) {
  return Walk(file, channels, options).result();
}

std::uint64_t McapFields::number(std::size_t bytes) {
  const std::string_view raw = take(bytes);
  std::uint64_t value = 0;
  for (std::size_t i = raw.size(); i-- > 0;)
    value = value << 8 | static_cast<unsigned char>(raw[i]);
  return value;
}

std::string_view McapFields::take(std::uint64_t bytes) {
  if (bytes > rest_.size()) {
    good_ = false;
    rest_ = {};
    return {};
  }
  const std::string_view taken = rest_.substr(0, bytes);
  rest_.remove_prefix(bytes);
  return taken;
}

std::optional<McapRecords::Record> McapRecords::next() {
  if (bytes_.size() < kHead) return std::nullopt;
  McapFields fields(bytes_);
  Record record;
  record.opcode = static_cast<std::uint8_t>(fields.number(1));
  record.content = fields.take(fields.number(8));
  if (!fields.good() || record.opcode == 0) return std::nullopt;
  bytes_ = fields.rest();
  return record;
}

bool McapChannels::read(std::uint8_t opcode, std::string_view content) {
  if (opcode == mcap::kChannel) return read_channel(content);
  if (opcode != mcap::kSchema) return true;
  McapFields fields(content);
  const auto id = static_cast<std::uint16_t>(fields.number(2));
  const std::string_view name = fields.text();
  if (fields.good()) schemas_[id] = printable(std::string(name));
  return fields.good();
}

bool McapChannels::read_channel(std::string_view content) {
  McapFields fields(content);
  const auto id = static_cast<std::uint16_t>(fields.number(2));
  const auto schema = static_cast<std::uint16_t>(fields.number(2));
  StoredTopic topic;
  topic.name = printable(std::string(fields.text()));
  topic.encoding = printable(std::string(fields.text()));
  McapFields extras(fields.text());
  while (extras.good() && !extras.rest().empty()) {
    const std::string_view key = extras.text(), value = extras.text();
    if (key == "offered_qos_profiles") topic.qos = value;
  }
  if (!fields.good()) return false;
  if (const auto known = schemas_.find(schema); known != schemas_.end()) topic.type = known->second;
  const auto same = [&](const StoredTopic& t) {
    return t.name == topic.name && t.type == topic.type;
  };
  const auto found = std::find_if(topics_.begin(), topics_.end(), same);
  by_channel_[id] = static_cast<std::size_t>(found - topics_.begin());
  if (found == topics_.end()) topics_.push_back(topic);
  return true;
}

std::optional<std::size_t> McapChannels::topic_of(std::uint16_t channel) const {
  const auto found = by_channel_.find(channel);
  return found == by_channel_.end() ? std::nullopt : std::optional(found->second);
}

void McapChannels::count(std::uint16_t channel, std::int64_t messages) {
  if (const auto topic = topic_of(channel)) topics_[*topic].count += messages;
}

}  // namespace lamina::ros2
