// SQLite's own readers of journals, on a copy where they would have to write.
#include <lamina/sensors/ros2/sqlite_file.hpp>

#include <sqlite3.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/storage.hpp>

namespace lamina::ros2 {
namespace {

namespace fs = std::filesystem;

// What has a meaning in a URI is written as its code.
std::string escaped(const std::string& path) {
  std::string text;
  for (const char c : path) {
    if (c == '%' || c == '?' || c == '#') {
      char code[4];
      std::snprintf(code, sizeof code, "%%%02X", c);
      text += code;
    } else {
      text += c;
    }
  }
  return text;
}

bool holds_bytes(const fs::path& file) {
  std::error_code error;
  return fs::file_size(file, error) > 0 && !error;
}

fs::path beside(const fs::path& file, const char* ending) { return file.string() + ending; }

std::array<const char*, 2> journals() { return {"-wal", "-journal"}; }

}  // namespace

SqliteRows::SqliteRows(sqlite3* database, const std::string& query) : database_(database) {
  if (sqlite3_prepare_v2(database, query.c_str(), -1, &statement_, nullptr) != SQLITE_OK)
    error_ = printable(sqlite3_errmsg(database));
}

SqliteRows::~SqliteRows() { sqlite3_finalize(statement_); }

bool SqliteRows::next() {
  if (!statement_ || !error_.empty()) return false;
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) error_ = printable(sqlite3_errmsg(database_));
  return false;
}

std::int64_t SqliteRows::integer(int column) const {
  return sqlite3_column_int64(statement_, column);
}

std::string_view SqliteRows::bytes(int column) const {
  const void* data = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  if (!data || size <= 0) return {};
  return {static_cast<const char*>(data), static_cast<std::size_t>(size)};
}

std::string SqliteRows::text(int column) const { return std::string(bytes(column)); }

SqliteFile::SqliteFile(const fs::path& file, std::string name) : name_(std::move(name)) {
  const auto endings = journals();
  const bool journal = std::any_of(endings.begin(), endings.end(), [&](const char* ending) {
    return holds_bytes(beside(file, ending));
  });
  if (journal) open_copy(file);
  if (!journal && !open(file, "mode=ro&immutable=1"))
    throw input_error(name_, "", "a damaged SQLite database (" + why_ + ")",
                      "a ROS 2 recording (.db3)");
  if (database_) return;
  close();
  throw input_error(name_, "",
                    "an SQLite database whose journal cannot be played back (" + why_ + ")",
                    "a recorder that has closed the file, or room in the temporary folder");
}

SqliteFile::~SqliteFile() { close(); }

void SqliteFile::close() {
  sqlite3_close(database_);
  database_ = nullptr;
  std::error_code ignored;
  if (!copy_.empty()) fs::remove_all(copy_, ignored);
}

bool SqliteFile::open(const fs::path& file, const char* how) {
  const std::string uri = "file:" + escaped(fs::absolute(file).string()) + "?" + how;
  const int flags = SQLITE_OPEN_URI | SQLITE_OPEN_READWRITE;
  if (sqlite3_open_v2(uri.c_str(), &database_, flags, nullptr) == SQLITE_OK) {
    harden();
    SqliteRows rows(database_, "SELECT name FROM sqlite_master LIMIT 1");
    rows.next();
    why_ = rows.error();
    if (why_.empty()) return true;
  } else {
    why_ = database_ ? sqlite3_errmsg(database_) : "out of memory";
  }
  sqlite3_close(database_);
  database_ = nullptr;
  return false;
}

// A file from anywhere: no code in its schema runs, no value is larger than any message.
void SqliteFile::harden() {
  sqlite3_limit(database_, SQLITE_LIMIT_LENGTH, 1 << 29);  // bytes
  sqlite3_db_config(database_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(database_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(database_, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_db_config(database_, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_exec(database_, "PRAGMA cell_size_check=ON", nullptr, nullptr, nullptr);
}

void SqliteFile::open_copy(const fs::path& file) {
  std::string folder = (fs::temp_directory_path() / "lamina_XXXXXX").string();
  std::error_code error;
  if (!::mkdtemp(folder.data())) {
    why_ = "no folder can be made in " + fs::temp_directory_path().string();
    return;
  }
  copy_ = folder;
  const fs::path copy = copy_ / "copy.db3";
  fs::copy_file(file, copy, error);
  for (const char* ending : journals()) {
    if (!error && holds_bytes(beside(file, ending)))
      fs::copy_file(beside(file, ending), beside(copy, ending), error);
  }
  for (const auto& entry : fs::directory_iterator(copy_))  // of a folder that is only read
    fs::permissions(entry.path(), fs::perms::owner_read | fs::perms::owner_write);
  if (error) {
    why_ = error.message();
  } else {
    open(copy, "mode=rw");
  }
}

std::vector<std::string> SqliteFile::columns(const std::string& table) {
  std::vector<std::string> names;
  const auto kind = query("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = '" + table +
                          "' AND sql NOT LIKE 'CREATE VIRTUAL%'");
  if (!kind->next()) return names;
  const auto rows = query("PRAGMA table_info(" + table + ")");
  while (rows->next()) names.push_back(rows->text(1));
  return names;
}

std::unique_ptr<SqliteRows> SqliteFile::query(const std::string& text) {
  return std::make_unique<SqliteRows>(database_, text);
}

}  // namespace lamina::ros2
