// SQLite recordings of several releases, with journals, damaged, and databases that are none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/db3_storage.hpp>
#include <lamina/sensors/ros2/record_writer.hpp>
#include <lamina/sensors/text.hpp>

#include "sensors/temporary_folder.hpp"

namespace lamina::ros2 {
namespace {

using test::TemporaryFolder;

class Database {
 public:
  explicit Database(const std::string& file) {
    EXPECT_EQ(sqlite3_open(file.c_str(), &database_), SQLITE_OK);
  }
  ~Database() { sqlite3_close(database_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  void run(const std::string& text) {
    EXPECT_EQ(sqlite3_exec(database_, text.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database_);
  }

 private:
  sqlite3* database_ = nullptr;
};

constexpr const char* kMessages =
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER "
    "NOT "
    "NULL, data BLOB NOT NULL);";

std::vector<std::string> read(Storage& storage) {
  std::vector<std::string> all;
  StoredMessage message;
  while (storage.next(message))
    all.push_back(storage.topics()[message.topic].name + std::string(message.bytes));
  return all;
}

std::string error_of(const std::string& file) {
  try {
    read(*open_db3(file, "x.db3"));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Db3, SchemasOfAllReleases) {
  const std::string eloquent =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format "
      "TEXT);"
      "INSERT INTO topics VALUES(1,'/a','A','cdr'),(2,'/b','B','cdr');";
  const std::string humble =
      "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
      "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER, metadata TEXT);"
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format "
      "TEXT, "
      "offered_qos_profiles TEXT);"
      "INSERT INTO topics VALUES(1,'/a','A','cdr','x'),(2,'/b','B','cdr','y');";
  const std::string jazzy =
      "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, "
      "encoded_message_definition TEXT, type_description_hash TEXT);"
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format "
      "TEXT, "
      "offered_qos_profiles TEXT, type_description_hash TEXT);"
      "INSERT INTO topics VALUES(1,'/a','A','cdr','x','h'),(2,'/b','B','cdr','y','h');";
  for (const std::string& schema : {eloquent, humble, jazzy}) {
    const TemporaryFolder folder;
    Database(folder.file("x.db3"))
        .run(schema + kMessages +
             "INSERT INTO messages VALUES(1,2,30,'third'),(2,1,10,'first'),(3,2,20,'second');");
    const auto storage = open_db3(folder.file("x.db3"), "x.db3");
    ASSERT_EQ(storage->topics().size(), 2u);
    EXPECT_EQ(storage->topics()[1].count, 2);
    EXPECT_EQ(storage->topics()[1].encoding, "cdr");
    EXPECT_THAT(read(*storage), testing::ElementsAre("/afirst", "/bsecond", "/bthird"));
    storage->select({true, false});
    EXPECT_THAT(read(*storage), testing::ElementsAre("/afirst"));
  }
}

// As a recorder leaves it that was killed: what it wrote last is in the journal alone. The folder
// stays as it was.
TEST(Db3, JournalsAreReadAndFoldersStayAsTheyAre) {
  const TemporaryFolder folder, killed;
  Database recorder(folder.file("x.db3"));
  recorder.run("PRAGMA journal_mode=WAL");
  recorder.run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT);" +
               std::string(kMessages) +
               "INSERT INTO topics VALUES(1,'/a','A');INSERT INTO messages VALUES(1,1,10,'whole')");
  const std::filesystem::path at = killed.path() / "killed #1?.db3";
  std::filesystem::create_directories(killed.path());
  std::filesystem::copy_file(folder.file("x.db3"), at);
  std::filesystem::copy_file(folder.file("x.db3-wal"), at.string() + "-wal");
  const auto files = [&] {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(killed.path()))
      ++count;
    return count;
  };
  const std::size_t before = files();
  {
    const auto storage = open_db3(at, "x.db3");
    EXPECT_THAT(read(*storage), testing::ElementsAre("/awhole"));
    EXPECT_EQ(files(), before);
  }
  EXPECT_EQ(files(), before);
}

TEST(Db3, DatabasesThatAreNoRecordings) {
  const TemporaryFolder folder;
  folder.write("text.db3",
               "this is no database, whatever its name says; and it is long enough....");
  EXPECT_THAT(error_of(folder.file("text.db3")), testing::HasSubstr("damaged SQLite database"));
  Database(folder.file("other.db3")).run("CREATE TABLE messages(id INTEGER)");
  EXPECT_THAT(error_of(folder.file("other.db3")),
              testing::HasSubstr("without ROS 2's tables topics and messages"));
  // A view that never ends is no table.
  Database(folder.file("view.db3"))
      .run(
          "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT);"
          "CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM "
          "n) "
          "SELECT id, 1 AS topic_id, id AS timestamp, 'x' AS data FROM n");
  EXPECT_THAT(error_of(folder.file("view.db3")), testing::HasSubstr("without ROS 2's tables"));
}

TEST(Db3, CutAndDamagedFiles) {
  const TemporaryFolder folder;
  const auto writer = make_db3_writer(folder.file("whole.db3"));
  writer->add_topic("/a", "A");
  for (int i = 0; i < 200; ++i)
    writer->write(0, i, std::string(100, static_cast<char>('a' + i % 26)));
  writer->close();
  const std::string whole = read_file_bytes(folder.file("whole.db3"));
  for (std::size_t size = 0; size < whole.size(); size += 777) {
    folder.write("cut.db3", whole.substr(0, size));
    std::string bytes = whole;
    for (std::size_t at = size; at < std::min(size + 16, bytes.size()); ++at) bytes[at] = '\x5a';
    folder.write("damaged.db3", bytes);
    for (const char* name : {"cut.db3", "damaged.db3"}) {
      const std::string error = error_of(folder.file(name));  // none, or one line
      EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    }
  }
}

}  // namespace
}  // namespace lamina::ros2
