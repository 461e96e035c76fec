// An SQLite database that is only read, and whose folder stays as it is.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace lamina::ros2 {

/// One query, row by row.
class SqliteRows {
 public:
  ~SqliteRows();
  SqliteRows(sqlite3* database, const std::string& query);
  SqliteRows(const SqliteRows&) = delete;
  SqliteRows& operator=(const SqliteRows&) = delete;

  /// False at the end, and where the file cannot be read further: error() is then not empty.
  bool next();
  std::int64_t integer(int column) const;
  std::string text(int column) const;
  /// Until the next call of next().
  std::string_view bytes(int column) const;
  const std::string& error() const { return error_; }

 private:
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  std::string error_;
};

class SqliteFile {
 public:
  /// `file` may have a journal beside it, also where its folder cannot be written: then, and where
  /// the journal has to be played back, a copy of both is read. `name` stands in messages. Throws
  /// lamina::Error when it is no database.
  SqliteFile(const std::filesystem::path& file, std::string name);
  ~SqliteFile();
  SqliteFile(const SqliteFile&) = delete;
  SqliteFile& operator=(const SqliteFile&) = delete;

  /// Names of a table's columns; empty when there is no such table (views and virtual tables are
  /// none).
  std::vector<std::string> columns(const std::string& table);
  std::unique_ptr<SqliteRows> query(const std::string& text);

 private:
  bool open(const std::filesystem::path& file, const char* how);
  void open_copy(const std::filesystem::path& file);
  void close();
  void harden();

  std::string name_, why_;
  std::filesystem::path copy_;  // a folder; empty: none was needed
  sqlite3* database_ = nullptr;
};

}  // namespace lamina::ros2
