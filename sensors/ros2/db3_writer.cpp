// SQLite in one transaction.
#include <sqlite3.h>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/record_writer.hpp>

namespace lamina::ros2 {
namespace {

class Db3Writer final : public RecordWriter {
 public:
  explicit Db3Writer(const std::filesystem::path& file) : name_(file.string()) {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
    if (sqlite3_open(name_.c_str(), &database_) != SQLITE_OK) fail();
    run("PRAGMA synchronous=OFF");
    run("BEGIN");
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,"
        "serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL)");
    run("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,"
        "timestamp INTEGER NOT NULL,data BLOB NOT NULL)");
    run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
    prepare(
        "INSERT INTO topics(name,type,serialization_format,offered_qos_profiles) "
        "VALUES(?,?,'cdr','')",
        &topic_);
    prepare("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)", &message_);
  }
  ~Db3Writer() override {
    sqlite3_finalize(topic_);
    sqlite3_finalize(message_);
    sqlite3_close(database_);
  }
  void add_topic(const std::string& name, const std::string& type) override {
    sqlite3_bind_text(topic_, 1, name.c_str(), -1, SQLITE_TRANSIENT);
    sqlite3_bind_text(topic_, 2, type.c_str(), -1, SQLITE_TRANSIENT);
    step(topic_);
  }
  void write(std::size_t topic, std::int64_t log_ns, std::string_view bytes) override {
    sqlite3_bind_int64(message_, 1, static_cast<std::int64_t>(topic) + 1);
    sqlite3_bind_int64(message_, 2, log_ns);
    sqlite3_bind_blob64(message_, 3, bytes.data(), bytes.size(), SQLITE_STATIC);
    step(message_);
  }
  void close() override { run("COMMIT"); }

 private:
  [[noreturn]] void fail() const {
    throw input_error(name_, "",
                      std::string("an error of SQLite (") + sqlite3_errmsg(database_) + ")",
                      "a writable folder with room");
  }
  void run(const char* text) {
    if (sqlite3_exec(database_, text, nullptr, nullptr, nullptr) != SQLITE_OK) fail();
  }
  void prepare(const char* text, sqlite3_stmt** statement) {
    if (sqlite3_prepare_v2(database_, text, -1, statement, nullptr) != SQLITE_OK) fail();
  }
  void step(sqlite3_stmt* statement) {
    if (sqlite3_step(statement) != SQLITE_DONE) fail();
    sqlite3_reset(statement);
  }

  std::string name_;
  sqlite3* database_ = nullptr;
  sqlite3_stmt *topic_ = nullptr, *message_ = nullptr;
};

}  // namespace

std::unique_ptr<RecordWriter> make_db3_writer(const std::filesystem::path& file) {
  return std::make_unique<Db3Writer>(file);
}

}  // namespace lamina::ros2
