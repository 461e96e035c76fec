// Files one after the other, and what metadata.yaml says of them.
#include <lamina/sensors/ros2/ros2_sink.hpp>

#include <algorithm>
#include <fstream>
#include <limits>
#include <vector>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/cdr_writer.hpp>

namespace lamina::ros2 {
namespace {

namespace fs = std::filesystem;

struct WrittenTopic {
  std::string name, type;
  std::int64_t count = 0;
};

class FolderSink final : public bag::Sink {
 public:
  FolderSink(fs::path folder, SinkOptions options)
      : folder_(std::move(folder)), options_(std::move(options)) {
    std::error_code error;
    fs::create_directories(folder_, error);
    if (!fs::is_directory(folder_, error))
      throw input_error(folder_.string(), "", "a folder that cannot be made", "a writable place");
  }

  void write(const bag::Message& message, std::int64_t log_ns) override {
    const CdrMessage coded = encode(message, options_.big_endian);
    LAMINA_CHECK(!coded.type.empty());
    const std::int64_t time = log_ns != 0 ? log_ns : message.stamp_ns;
    first_ = std::min(first_, time);
    last_ = std::max(last_, time);
    if (!writer_ || (options_.messages_per_file > 0 && in_file_ == options_.messages_per_file))
      begin_file();
    const std::size_t topic = topic_of(message.topic, coded.type);
    writer_->write(in_writer(topic), time, coded.bytes);
    ++topics_[topic].count;
    ++in_file_;
  }

  void close() override {
    if (!writer_) begin_file();
    writer_->close();
    write_metadata();
  }

 private:
  void begin_file() {
    if (writer_) writer_->close();
    const std::string ending = options_.storage == "db3" ? ".db3" : ".mcap";
    files_.push_back(folder_.filename().string() + "_" + std::to_string(files_.size()) + ending);
    const fs::path file = folder_ / files_.back();
    writer_ =
        options_.storage == "db3" ? make_db3_writer(file) : make_mcap_writer(file, options_.mcap);
    numbers_.clear();
    in_file_ = 0;
  }
  std::size_t topic_of(const std::string& name, const std::string& type) {
    const auto known = std::find_if(topics_.begin(), topics_.end(),
                                    [&](const WrittenTopic& t) { return t.name == name; });
    const auto index = static_cast<std::size_t>(known - topics_.begin());
    if (known == topics_.end()) topics_.push_back({name, type, 0});
    return index;
  }
  // The number of a topic in the open file, which may not have it yet.
  std::size_t in_writer(std::size_t topic) {
    const auto known = std::find(numbers_.begin(), numbers_.end(), topic);
    const auto number = static_cast<std::size_t>(known - numbers_.begin());
    if (known == numbers_.end()) {
      writer_->add_topic(topics_[topic].name, topics_[topic].type);
      numbers_.push_back(topic);
    }
    return number;
  }
  void write_metadata() const {
    std::ofstream out(folder_ / "metadata.yaml");
    std::int64_t all = 0;
    for (const WrittenTopic& topic : topics_) all += topic.count;
    out << "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: "
        << (options_.storage == "db3" ? "sqlite3" : "mcap")
        << "\n  duration:\n    nanoseconds: " << (all > 0 ? last_ - first_ : 0)
        << "\n  starting_time:\n    nanoseconds_since_epoch: " << (all > 0 ? first_ : 0)
        << "\n  message_count: " << all << "\n  topics_with_message_count:\n";
    for (const WrittenTopic& topic : topics_)
      out << "    - topic_metadata:\n        name: " << topic.name
          << "\n        type: " << topic.type
          << "\n        serialization_format: cdr\n        offered_qos_profiles: \"\"\n      "
             "message_count: "
          << topic.count << "\n";
    out << "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n";
    for (const std::string& file : files_) out << "    - " << file << "\n";
    if (!out.flush())
      throw input_error((folder_ / "metadata.yaml").string(), "", "a file that cannot be written",
                        "a writable folder");
  }

  fs::path folder_;
  SinkOptions options_;
  std::unique_ptr<RecordWriter> writer_;
  std::vector<WrittenTopic> topics_;
  std::vector<std::size_t> numbers_;  // topics of the open file
  std::vector<std::string> files_;
  std::int64_t in_file_ = 0, first_ = std::numeric_limits<std::int64_t>::max(), last_ = 0;
};

}  // namespace

std::unique_ptr<bag::Sink> make_sink(const fs::path& folder, const SinkOptions& options) {
  return std::make_unique<FolderSink>(folder, options);
}

}  // namespace lamina::ros2

namespace lamina::bag {

std::unique_ptr<Sink> make_ros2_sink(const std::string& folder, const std::string& storage) {
  ros2::SinkOptions options;
  options.storage = storage;
  return ros2::make_sink(folder, options);
}

}  // namespace lamina::bag
