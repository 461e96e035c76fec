// MCAP in every form: packed or not, with and without chunks, indices and summary, cut, damaged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/mcap_storage.hpp>
#include <lamina/sensors/ros2/record_writer.hpp>
#include <lamina/sensors/ros2/ros2_source.hpp>
#include <lamina/sensors/text.hpp>

#include "sensors/temporary_folder.hpp"

namespace lamina::ros2 {
namespace {

using test::TemporaryFolder;

std::string body(int i) { return "message " + std::to_string(i) + std::string(40, '.'); }

void write(const std::string& file, const McapWriterOptions& options, int messages = 100) {
  const auto writer = make_mcap_writer(file, options);
  writer->add_topic("/a", "std_msgs/msg/A");
  writer->add_topic("/b", "std_msgs/msg/B");
  for (int i = 0; i < messages; ++i)
    writer->write(static_cast<std::size_t>(i % 3 == 0), 1000 + i, body(i));
  writer->close();
}

struct Content {
  std::vector<std::string> bytes;
  std::vector<std::int64_t> times;
  std::vector<std::string> problems;
};

Content read(Storage& storage) {
  Content content;
  StoredMessage message;
  while (storage.next(message)) {
    content.bytes.emplace_back(message.bytes);
    content.times.push_back(message.log_ns);
  }
  content.problems = storage.problems();
  return content;
}

Content read(const std::string& file) { return read(*open_mcap(file, "x.mcap")); }

std::vector<McapWriterOptions> forms() {
  std::vector<McapWriterOptions> all;
  for (const char* compression : {"", "lz4", "zstd"}) {
    for (const bool more : {false, true}) all.push_back({compression, 400, more, more});
  }
  all.push_back({"", 0, false, true});
  all.push_back({"", 0, false, false});
  return all;
}

TEST(Mcap, EveryFormHoldsTheSame) {
  const TemporaryFolder folder;
  for (const McapWriterOptions& options : forms()) {
    write(folder.file("x.mcap"), options);
    const auto storage = open_mcap(folder.file("x.mcap"), "x.mcap");
    ASSERT_EQ(storage->topics().size(), 2u);
    EXPECT_EQ(storage->topics()[0].name, "/a");
    EXPECT_EQ(storage->topics()[0].type, "std_msgs/msg/A");
    EXPECT_EQ(storage->topics()[0].encoding, "cdr");
    EXPECT_EQ(storage->topics()[0].count, 66);
    EXPECT_EQ(storage->topics()[1].count, 34);
    const Content content = read(*storage);
    ASSERT_EQ(content.bytes.size(), 100u);
    for (int i = 0; i < 100; ++i) {
      EXPECT_EQ(content.bytes[static_cast<std::size_t>(i)], body(i));
      EXPECT_EQ(content.times[static_cast<std::size_t>(i)], 1000 + i);
    }
    EXPECT_TRUE(content.problems.empty());
    storage->select({false, true});
    EXPECT_EQ(read(*storage).bytes.size(), 34u);
  }
}

TEST(Mcap, CutAtAnyByteGivesWhatIsWhole) {
  const TemporaryFolder folder;
  for (const McapWriterOptions& options : forms()) {
    write(folder.file("whole.mcap"), options, 20);
    const std::string whole = read_file_bytes(folder.file("whole.mcap"));
    std::size_t last = 0;
    for (std::size_t size = 8; size < whole.size(); size += 1 + size / 19) {
      folder.write("cut.mcap", whole.substr(0, size));
      const Content content = read(folder.file("cut.mcap"));
      for (std::size_t i = 0; i < content.bytes.size(); ++i)
        ASSERT_EQ(content.bytes[i], body(static_cast<int>(i)));
      EXPECT_GE(content.bytes.size(), last);
      EXPECT_LE(content.problems.size(), 1u);
      last = content.bytes.size();
    }
    EXPECT_GE(last, 10u);
  }
}

TEST(Mcap, DamageIsSaidAndEndsNothing) {
  const TemporaryFolder folder;
  write(folder.file("x.mcap"), {"zstd", 400, true, true});
  const std::string whole = read_file_bytes(folder.file("x.mcap"));
  for (std::size_t at = 8; at < whole.size(); at += 61) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x5a);
    folder.write("damaged.mcap", bytes);
    for (const std::string& found : read(folder.file("damaged.mcap")).bytes)
      ASSERT_EQ(found.substr(0, 8), "message ");
  }
}

TEST(Mcap, AWrongChecksumLeavesItsChunkOut) {
  const TemporaryFolder folder;
  write(folder.file("x.mcap"), {"", 400, true, true});
  std::string bytes = read_file_bytes(folder.file("x.mcap"));
  bytes[bytes.find("message 0.") + 3] = 'x';
  folder.write("x.mcap", bytes);
  const Content content = read(folder.file("x.mcap"));
  EXPECT_LT(content.bytes.size(), 100u);
  EXPECT_GT(content.bytes.size(), 80u);
  ASSERT_EQ(content.problems.size(), 1u);
  EXPECT_THAT(content.problems[0], testing::HasSubstr("its checksum is wrong, it was left out"));
}

// Records outside of chunks by hand: sizes that lie, and a chunk of an unknown compression.
TEST(Mcap, ClaimsAreBounded) {
  const TemporaryFolder folder;
  const std::string magic = "\x89MCAP0\r\n";
  for (const char opcode : {1, 3, 4, 5, 6, 11}) {
    for (const int filled : {0, 8}) {
      std::string bytes = magic;
      bytes += opcode;
      bytes += std::string(static_cast<std::size_t>(filled), '\xff') + std::string(16, '\x7f');
      folder.write("x.mcap", bytes);
      EXPECT_TRUE(read(folder.file("x.mcap")).bytes.empty());
    }
  }
  folder.write("x.mcap", "no mcap at all");
  EXPECT_THROW(read(folder.file("x.mcap")), Error);
}

// What the fuzzer began from and found: a channel that only shows up when messages are read.
TEST(Mcap, SeedsOfTheFuzzerAreReadToTheirEnd) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(LAMINA_SOURCE_DIR "/tests/fuzz/seeds/mcap")) {
    const auto source = make_source(open_mcap(entry.path(), "x.mcap"));
    std::vector<std::string> names;
    for (const bag::Topic& topic : source->topics()) names.push_back(topic.name);
    source->select(names);
    bag::Message message;
    while (source->next(message) != bag::Source::Status::kEnd) {
    }
    ++files;
  }
  EXPECT_GE(files, 5);
}

// Chunks of one topic each, as some writers make them: their times overlap.
TEST(Mcap, OverlappingChunksAreMergedByTime) {
  const TemporaryFolder folder;
  const auto writer = make_mcap_writer(folder.file("x.mcap"), {"lz4", 3000, true, true});
  writer->add_topic("/a", "A");
  writer->add_topic("/b", "B");
  for (const std::size_t topic : {0u, 1u}) {
    for (int i = 0; i < 100; ++i)
      writer->write(topic, 1000 + 2 * i + static_cast<int>(topic), body(i));
  }
  writer->close();
  const Content content = read(folder.file("x.mcap"));
  ASSERT_EQ(content.times.size(), 200u);
  EXPECT_TRUE(std::is_sorted(content.times.begin(), content.times.end()));
}

}  // namespace
}  // namespace lamina::ros2
