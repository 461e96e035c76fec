// Bytes of a storage, unpacked and decoded.
#include <lamina/sensors/ros2/ros2_source.hpp>

#include <algorithm>
#include <deque>

#include <lamina/sensors/readers/bag_depth.hpp>
#include <lamina/sensors/ros2/cdr_messages.hpp>
#include <lamina/sensors/ros2/unpack.hpp>

namespace lamina::ros2 {
namespace {

class Ros2Source final : public bag::Source {
 public:
  Ros2Source(std::unique_ptr<Storage> storage, const SourceOptions& options)
      : storage_(std::move(storage)), options_(options) {
    for (const StoredTopic& topic : storage_->topics()) types_.push_back(type_of_ros1(topic.type));
  }

  std::vector<bag::Topic> topics() const override {
    std::vector<bag::Topic> all;
    for (std::size_t i = 0; i < storage_->topics().size(); ++i) {
      const StoredTopic& stored = storage_->topics()[i];
      bag::Topic topic{stored.name, types_[i], stored.count, ""};
      if (stored.encoding != "cdr")
        topic.unread = "serialization '" + stored.encoding + "' instead of 'cdr'";
      all.push_back(topic);
    }
    std::sort(all.begin(), all.end(),
              [](const bag::Topic& a, const bag::Topic& b) { return a.name < b.name; });
    return all;
  }

  void select(const std::vector<std::string>& topics) override {
    std::vector<bool> wanted;
    for (const StoredTopic& stored : storage_->topics())
      wanted.push_back(std::find(topics.begin(), topics.end(), stored.name) != topics.end());
    storage_->select(wanted);
    waiting_.clear();
  }

  Status next(bag::Message& message) override {
    while (true) {
      if (!waiting_.empty()) {
        message = std::move(waiting_.front());
        waiting_.pop_front();
        return Status::kMessage;
      }
      StoredMessage stored;
      if (!storage_->next(stored)) return Status::kEnd;
      const Status status = read(stored, message);
      if (waiting_.empty()) return status;
    }
  }

  std::vector<std::string> problems() const override { return storage_->problems(); }

 private:
  Status read(const StoredMessage& stored, bag::Message& message) {
    const StoredTopic& topic = storage_->topics()[stored.topic];
    message = bag::Message();
    message.topic = topic.name;
    message.stamp_ns = stored.log_ns;
    if (topic.encoding != "cdr") return Status::kWrongFormat;
    std::string_view bytes = stored.bytes;
    if (is_zstd(bytes)) {
      unpacked_.clear();
      if (!unpack_zstd(bytes, options_.largest_message, unpacked_)) return Status::kDamaged;
      bytes = unpacked_;
    }
    return decode(types_[stored.topic], bytes, depth_, message, waiting_);
  }

  std::unique_ptr<Storage> storage_;
  SourceOptions options_;
  std::vector<std::string> types_;    // of its topics, as ROS 1 has them
  std::deque<bag::Message> waiting_;  // transforms of one message
  bag::DepthReader depth_;
  std::string unpacked_;
};

}  // namespace

std::unique_ptr<bag::Source> make_source(std::unique_ptr<Storage> storage,
                                         const SourceOptions& options) {
  return std::make_unique<Ros2Source>(std::move(storage), options);
}

}  // namespace lamina::ros2
