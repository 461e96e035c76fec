// Folders of ROS 2 recordings: splits, packed files, and metadata.yaml that is not what it should
// be.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/bag_folder.hpp>
#include <lamina/sensors/ros2/bag_storage.hpp>
#include <lamina/sensors/ros2/ros2_sink.hpp>
#include <lamina/sensors/text.hpp>

#include "sensors/temporary_folder.hpp"

namespace lamina::ros2 {
namespace {

using test::TemporaryFolder;

constexpr int kMessages = 110;

void write_splits(const TemporaryFolder& folder, const std::string& storage) {
  SinkOptions options;
  options.storage = storage;
  options.messages_per_file = 10;
  const auto sink = make_sink(folder.path() / "bag", options);
  for (int i = 0; i < kMessages; ++i) {
    bag::Message m;
    m.kind = i % 2 == 0 ? bag::Kind::kOdometry : bag::Kind::kScan;
    m.topic = i % 2 == 0 ? "/odom" : "/scan";
    m.stamp_ns = 1000 + i;
    m.ranges = {1, 2};
    sink->write(m);
  }
  sink->close();
}

std::vector<std::int64_t> times_of(Storage& storage) {
  std::vector<std::int64_t> all;
  StoredMessage message;
  while (storage.next(message)) all.push_back(message.log_ns);
  return all;
}

void expect_all(const std::filesystem::path& path, const std::string& problem) {
  const auto storage = open_storage(path);
  const auto found = times_of(*storage);
  EXPECT_EQ(found.size(), static_cast<std::size_t>(kMessages));
  EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
  ASSERT_EQ(storage->topics().size(), 2u);
  EXPECT_EQ(storage->topics()[0].count, kMessages / 2);
  if (problem.empty()) {
    EXPECT_TRUE(storage->problems().empty());
  } else {
    EXPECT_THAT(storage->problems(), testing::ElementsAre(testing::HasSubstr(problem)));
  }
}

// Eleven files: the tenth and eleventh come behind the ninth also by name.
TEST(BagFolder, SplitsFollowEachOther) {
  for (const char* storage : {"db3", "mcap"}) {
    const TemporaryFolder folder;
    write_splits(folder, storage);
    expect_all(folder.path() / "bag", "");
    folder.write("bag/metadata.yaml", "");
    expect_all(folder.path() / "bag", "it names no file: all files of the folder were read");
    folder.write("bag/metadata.yaml", "rosbag2_bagfile_information: [");
    expect_all(folder.path() / "bag", "it cannot be read (");
    folder.write("bag/metadata.yaml",
                 "rosbag2_bagfile_information:\n  relative_file_paths: [other_0.db3]\n");
    expect_all(folder.path() / "bag", "none of the files it names is here");
    std::filesystem::remove(folder.path() / "bag/metadata.yaml");
    expect_all(folder.path() / "bag", "it is missing");
  }
}

TEST(BagFolder, AFileThatIsGoneIsSaid) {
  const TemporaryFolder folder;
  write_splits(folder, "mcap");
  std::filesystem::remove(folder.path() / "bag/bag_3.mcap");
  folder.write("bag/other.mcap", "not named");
  const auto storage = open_storage(folder.path() / "bag");
  EXPECT_EQ(times_of(*storage).size(), 100u);
  EXPECT_THAT(storage->problems(),
              testing::ElementsAre(testing::HasSubstr("names 11 files of which 1 are not here"),
                                   testing::HasSubstr("other.mcap: not named by metadata.yaml"),
                                   testing::HasSubstr("counts 110 messages, here are 100")));
}

TEST(BagFolder, FilesPackedByZstandard) {
  for (const char* storage : {"db3", "mcap"}) {
    const TemporaryFolder folder;
    write_splits(folder, storage);
    for (const auto& path : files_of_bag(folder.path() / "bag").files) {
      const std::string plain = read_file_bytes(path.string());
      std::string packed(ZSTD_compressBound(plain.size()), '\0');
      packed.resize(ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 1));
      folder.write("bag/" + path.filename().string() + ".zstd", packed);
      std::filesystem::remove(path);
    }
    expect_all(folder.path() / "bag", "");
  }
}

TEST(BagFolder, NothingToRead) {
  const TemporaryFolder folder;
  folder.write("bag/metadata.yaml",
               "rosbag2_bagfile_information:\n  relative_file_paths: [a.db3]\n");
  EXPECT_THROW(open_storage(folder.path() / "bag"), Error);
  folder.write("bag/a.db3", "no database");
  EXPECT_THROW(open_storage(folder.path() / "bag"), Error);
}

}  // namespace
}  // namespace lamina::ros2
