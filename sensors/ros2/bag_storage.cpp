// One file after the other.
#include <lamina/sensors/ros2/bag_storage.hpp>

#include <stdlib.h>
#include <unistd.h>

#include <algorithm>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/compressed_text.hpp>
#include <lamina/sensors/ros2/bag_folder.hpp>
#include <lamina/sensors/ros2/db3_storage.hpp>
#include <lamina/sensors/ros2/mcap_blocks.hpp>
#include <lamina/sensors/ros2/mcap_storage.hpp>
#include <lamina/sensors/ros2/unpack.hpp>

namespace lamina::ros2 {
namespace {

namespace fs = std::filesystem;

// Has a name while it is filled and opened; what has it open then goes on reading.
class PassingFile {
 public:
  PassingFile() {
    std::string name = (fs::temp_directory_path() / "lamina_XXXXXX").string();
    const int descriptor = ::mkstemp(name.data());
    if (descriptor < 0)
      throw input_error(fs::temp_directory_path().string(), "", "a folder that cannot be written",
                        "a writable one (TMPDIR names it)");
    ::close(descriptor);
    path_ = name;
  }
  ~PassingFile() { ::unlink(path_.c_str()); }
  PassingFile(const PassingFile&) = delete;
  PassingFile& operator=(const PassingFile&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

struct OpenFile {
  std::unique_ptr<Storage> storage;
  std::vector<std::size_t> topics;  // of the file -> of all
};

// By the first bytes: a name may say anything.
std::unique_ptr<Storage> open_plain(const fs::path& file, const std::string& name) {
  const std::string start = PlacedFile(file).read(0, 6);
  const bool named = name.find(".mcap") != std::string::npos && start != "SQLite";
  if (named || start.rfind("\x89MCAP", 0) == 0) return open_mcap(file, name);
  return open_db3(file, name);
}

class BagStorage final : public Storage {
 public:
  void add(const fs::path& file) {
    OpenFile opened;
    if (compression_of(file) == Compression::kZstd) {
      const PassingFile plain;
      if (!unpack_zstd_file(file, plain.path()))
        problems_.push_back(file.string() + ": cut or damaged: what was whole was unpacked");
      opened.storage = open_plain(plain.path(), file.string());
    } else {
      opened.storage = open_plain(file, file.string());
    }
    for (const StoredTopic& topic : opened.storage->topics()) {
      const auto same = [&](const StoredTopic& t) {
        return t.name == topic.name && t.type == topic.type;
      };
      const auto known = std::find_if(topics_.begin(), topics_.end(), same);
      opened.topics.push_back(static_cast<std::size_t>(known - topics_.begin()));
      if (known == topics_.end()) {
        topics_.push_back(topic);
      } else {
        known->count += topic.count;
      }
    }
    files_.push_back(std::move(opened));
  }
  void add_problem(const std::string& problem) { problems_.push_back(problem); }

  const std::vector<StoredTopic>& topics() const override { return topics_; }
  void select(const std::vector<bool>& wanted) override {
    for (OpenFile& file : files_) {
      std::vector<bool> of_file;
      for (const std::size_t topic : file.topics)
        of_file.push_back(topic < wanted.size() && wanted[topic]);
      file.storage->select(of_file);
    }
    at_ = 0;
  }
  bool next(StoredMessage& message) override {
    for (; at_ < files_.size(); ++at_) {
      OpenFile& file = files_[at_];
      if (!file.storage->next(message)) continue;
      message.topic = file.topics[message.topic];
      return true;
    }
    return false;
  }
  std::vector<std::string> problems() const override {
    std::vector<std::string> all = problems_;
    for (const OpenFile& file : files_) {
      const auto more = file.storage->problems();
      all.insert(all.end(), more.begin(), more.end());
    }
    return all;
  }

 private:
  std::vector<OpenFile> files_;
  std::vector<StoredTopic> topics_;
  std::vector<std::string> problems_;
  std::size_t at_ = 0;
};

void check_count(const BagFiles& found, const fs::path& folder, BagStorage& bag) {
  std::int64_t here = 0;
  for (const StoredTopic& topic : bag.topics()) here += topic.count;
  if (!found.messages || *found.messages == here) return;
  bag.add_problem((folder / "metadata.yaml").string() + ": counts " +
                  std::to_string(*found.messages) + " messages, here are " + std::to_string(here));
}

}  // namespace

std::unique_ptr<Storage> open_storage(const fs::path& path) {
  auto bag = std::make_unique<BagStorage>();
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    bag->add(path);
    return bag;
  }
  const BagFiles found = files_of_bag(path);
  for (const std::string& problem : found.problems) bag->add_problem(problem);
  std::size_t read = 0;
  std::string first;
  for (const fs::path& file : found.files) {
    try {
      bag->add(file);
      ++read;
    } catch (const Error& problem) {
      if (first.empty()) first = problem.what();
      bag->add_problem(problem.what());
    }
  }
  if (read == 0) throw Error(first);
  check_count(found, path, *bag);
  return bag;
}

}  // namespace lamina::ros2
