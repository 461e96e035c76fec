// Chunks are opened when their time comes, and merged by the times of their messages.
#include <lamina/sensors/ros2/mcap_storage.hpp>

#include <zlib.h>

#include <algorithm>
#include <list>
#include <set>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/mcap_blocks.hpp>
#include <lamina/sensors/ros2/unpack.hpp>

namespace lamina::ros2 {
namespace {

class McapStorage final : public Storage {
 public:
  McapStorage(const std::filesystem::path& file, std::string name, const McapOptions& options)
      : name_(std::move(name)), options_(options), file_(file) {
    if (file_.read(0, 8) != "\x89MCAP0\r\n")
      throw input_error(name_, "", "a file that does not begin as MCAP does", "an MCAP file");
    layout_ = walk_mcap(file_, channels_);
    if (!layout_.problem.empty()) note(layout_.problem + ": what comes before was read");
    count();
    std::stable_sort(layout_.blocks.begin(), layout_.blocks.end(),
                     [](const auto& a, const auto& b) { return a.start_ns < b.start_ns; });
    topics_ = channels_.topics();
    wanted_.assign(topics_.size(), true);
  }

  const std::vector<StoredTopic>& topics() const override { return topics_; }
  void select(const std::vector<bool>& wanted) override {
    wanted_ = wanted;
    next_block_ = 0;
    open_.clear();
    held_ = 0;
  }
  bool next(StoredMessage& message) override;
  std::vector<std::string> problems() const override { return problems_; }

 private:
  struct Place {
    std::int64_t log_ns;
    std::size_t topic;
    std::string_view bytes;
  };
  struct OpenBlock {
    std::string bytes;
    std::vector<Place> places;  // by time
    std::size_t next = 0;
  };

  void note(const std::string& problem) {
    if (noted_.insert(problem).second) problems_.push_back(name_ + ": " + problem);
  }
  std::string unpack(const McapBlock& block);
  template <class Use>
  void read(McapBlock& block, std::string_view bytes, const Use& use);
  void count();
  bool open_next();

  std::string name_;
  McapOptions options_;
  PlacedFile file_;
  McapChannels channels_;
  McapLayout layout_;
  std::vector<StoredTopic> topics_;  // as the file was opened: no message is of another
  std::vector<bool> wanted_;
  std::size_t next_block_ = 0, held_ = 0;
  std::list<OpenBlock> open_;
  std::vector<std::string> problems_;
  std::set<std::string> noted_;
};

// Of a chunk whose checksum is wrong nothing is used: any of its numbers may be another.
std::string McapStorage::unpack(const McapBlock& block) {
  std::string packed = file_.read(block.at, block.size);
  std::string bytes;
  bool good = true;
  if (block.compression.empty()) {
    bytes = std::move(packed);
  } else if (block.compression == "zstd") {
    good = unpack_zstd(packed, options_.most_unpacked, bytes);
  } else if (block.compression == "lz4") {
    good = unpack_lz4(packed, options_.most_unpacked, bytes);
  } else {
    note("chunks of compression '" + block.compression + "', expected none, lz4 or zstd");
    return {};
  }
  const std::string place = "chunk at byte " + std::to_string(block.at);
  if (!block.cut && !good) note(place + ": damaged: what was whole was read");
  if (block.cut || block.crc == 0 || !good) return bytes;
  const void* data = bytes.data();
  const auto crc = crc32_z(0, static_cast<const Bytef*>(data), bytes.size());
  if (crc == block.crc) return bytes;
  note(place + ": damaged: its checksum is wrong, it was left out");
  return {};
}

// `use` gets channel, time and bytes of each message.
template <class Use>
void McapStorage::read(McapBlock& block, std::string_view bytes, const Use& use) {
  std::set<std::size_t> topics;
  McapRecords records(bytes);
  while (const auto record = records.next()) {
    channels_.read(record->opcode, record->content);
    if (record->opcode != mcap::kMessage) continue;
    McapFields fields(record->content);
    const auto channel = static_cast<std::uint16_t>(fields.number(2));
    fields.number(4);
    const auto log_ns = static_cast<std::int64_t>(fields.number(8));
    fields.number(8);
    if (!fields.good()) continue;
    if (const auto topic = channels_.topic_of(channel)) topics.insert(*topic);
    use(channel, log_ns, fields.rest());
  }
  block.topics = std::move(topics);
  if (!records.at_end() && !block.cut)
    note("chunk at byte " + std::to_string(block.at) + ": ends within a record");
}

// As the summary says, where the file is whole and its channels are known; else by reading it all.
void McapStorage::count() {
  bool known = layout_.whole;
  for (const auto& [channel, messages] : layout_.counts)
    known = known && messages >= 0 && channels_.topic_of(channel).has_value();
  if (known) {
    for (const auto& [channel, messages] : layout_.counts) channels_.count(channel, messages);
    return;
  }
  for (McapBlock& block : layout_.blocks) {
    const std::string bytes = unpack(block);
    read(block, bytes, [&](std::uint16_t channel, std::int64_t, std::string_view) {
      channels_.count(channel, 1);
    });
  }
}

bool McapStorage::open_next() {
  if (next_block_ == layout_.blocks.size()) return false;
  if (!open_.empty() && held_ >= options_.most_held) return false;
  McapBlock& block = layout_.blocks[next_block_];
  for (const OpenBlock& open : open_) {
    const auto start = static_cast<std::int64_t>(block.start_ns);
    if (open.places[open.next].log_ns < start) return false;
  }
  ++next_block_;
  const auto is_wanted = [&](std::size_t topic) {
    return topic < topics_.size() && topic < wanted_.size() && wanted_[topic];
  };
  if (block.topics && std::none_of(block.topics->begin(), block.topics->end(), is_wanted))
    return true;
  OpenBlock& open = open_.emplace_back();
  open.bytes = unpack(block);
  read(block, open.bytes, [&](std::uint16_t channel, std::int64_t log_ns, std::string_view bytes) {
    const auto topic = channels_.topic_of(channel);
    if (topic && *topic >= topics_.size())
      note("topic " + channels_.topics()[*topic].name + " is not in the summary: left out");
    if (topic && is_wanted(*topic)) open.places.push_back({log_ns, *topic, bytes});
  });
  std::stable_sort(open.places.begin(), open.places.end(),
                   [](const Place& a, const Place& b) { return a.log_ns < b.log_ns; });
  if (open.places.empty()) {
    open_.pop_back();
  } else {
    held_ += open.bytes.size();
  }
  return true;
}

bool McapStorage::next(StoredMessage& message) {
  // What was given last is dropped only now: its bytes were promised until this call.
  open_.remove_if([&](const OpenBlock& open) {
    const bool done = open.next == open.places.size();
    if (done) held_ -= open.bytes.size();
    return done;
  });
  while (open_next()) {
  }
  if (open_.empty()) return false;
  const auto first =
      std::min_element(open_.begin(), open_.end(), [](const OpenBlock& a, const OpenBlock& b) {
        return a.places[a.next].log_ns < b.places[b.next].log_ns;
      });
  const Place& place = first->places[first->next++];
  message = {place.topic, place.log_ns, place.bytes};
  return true;
}

}  // namespace

std::unique_ptr<Storage> open_mcap(const std::filesystem::path& file, const std::string& name,
                                   const McapOptions& options) {
  return std::make_unique<McapStorage>(file, name, options);
}

}  // namespace lamina::ros2
