// Rows by the time of their recording.
#include <lamina/sensors/ros2/db3_storage.hpp>

#include <algorithm>
#include <map>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/sqlite_file.hpp>

namespace lamina::ros2 {
namespace {

bool has(const std::vector<std::string>& columns, const char* name) {
  return std::find(columns.begin(), columns.end(), name) != columns.end();
}

class Db3Storage final : public Storage {
 public:
  Db3Storage(const std::filesystem::path& file, std::string name)
      : name_(std::move(name)), file_(file, name_) {
    const auto topics = file_.columns("topics"), messages = file_.columns("messages");
    bool whole = true;
    for (const char* column : {"id", "name", "type"}) whole = whole && has(topics, column);
    for (const char* column : {"id", "topic_id", "timestamp", "data"})
      whole = whole && has(messages, column);
    if (!whole)
      throw input_error(name_, "", "an SQLite database without ROS 2's tables topics and messages",
                        "a ROS 2 recording (.db3)");
    read_topics(topics);
    count();
    select(std::vector<bool>(topics_.size(), true));
  }

  const std::vector<StoredTopic>& topics() const override { return topics_; }
  void select(const std::vector<bool>& wanted) override {
    std::string ids;
    for (const auto& [id, topic] : by_id_) {
      if (topic < wanted.size() && wanted[topic])
        ids += (ids.empty() ? "" : ",") + std::to_string(id);
    }
    rows_ = file_.query("SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN (" + ids +
                        ") ORDER BY timestamp, id");
  }
  bool next(StoredMessage& message) override {
    if (!rows_->next()) {
      note(*rows_);
      return false;
    }
    const auto topic = by_id_.find(rows_->integer(0));
    if (topic == by_id_.end()) return false;
    message = {topic->second, rows_->integer(1), rows_->bytes(2)};
    return true;
  }
  std::vector<std::string> problems() const override { return problems_; }

 private:
  // Schemas before Foxy have no profiles, some writers no formats.
  void read_topics(const std::vector<std::string>& columns) {
    const auto optional = [&](const char* column, const char* otherwise) {
      return has(columns, column) ? std::string(column) : std::string(otherwise);
    };
    const auto rows =
        file_.query("SELECT id, name, type, " + optional("serialization_format", "'cdr'") + ", " +
                    optional("offered_qos_profiles", "''") + " FROM topics ORDER BY id");
    while (rows->next()) {
      StoredTopic topic{printable(rows->text(1)), printable(rows->text(2)),
                        printable(rows->text(3)), rows->text(4), 0};
      const auto same = [&](const StoredTopic& t) {
        return t.name == topic.name && t.type == topic.type;
      };
      const auto known = std::find_if(topics_.begin(), topics_.end(), same);
      by_id_[rows->integer(0)] = static_cast<std::size_t>(known - topics_.begin());
      if (known == topics_.end()) topics_.push_back(topic);
    }
    note(*rows);
  }
  void count() {
    const auto rows = file_.query("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id");
    while (rows->next()) {
      if (const auto topic = by_id_.find(rows->integer(0)); topic != by_id_.end())
        topics_[topic->second].count += rows->integer(1);
    }
    note(*rows);
  }
  void note(const SqliteRows& rows) {
    if (rows.error().empty() || !problems_.empty()) return;
    problems_.push_back(name_ + ": damaged (" + rows.error() + "): what could be read was read");
  }

  std::string name_;
  SqliteFile file_;
  std::map<std::int64_t, std::size_t> by_id_;
  std::vector<StoredTopic> topics_;
  std::unique_ptr<SqliteRows> rows_;
  std::vector<std::string> problems_;
};

}  // namespace

std::unique_ptr<Storage> open_db3(const std::filesystem::path& file, const std::string& name) {
  return std::make_unique<Db3Storage>(file, name);
}

}  // namespace lamina::ros2
