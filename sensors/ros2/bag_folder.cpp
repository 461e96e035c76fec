// metadata.yaml against the files that are there.
#include <lamina/sensors/ros2/bag_folder.hpp>

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <set>

#include <lamina/models/error.hpp>

namespace lamina::ros2 {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

// Numbers within names count as such: _10 comes after _9.
bool before(const fs::path& a, const fs::path& b) {
  const std::string x = a.filename().string(), y = b.filename().string();
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, k = 0;
  while (i < x.size() && k < y.size()) {
    if (is_digit(x[i]) && is_digit(y[k])) {
      const auto number = [&](const std::string& text, std::size_t& at) {
        const std::size_t begin = text.find_first_not_of('0', at);
        while (at < text.size() && is_digit(text[at])) ++at;
        return begin < at ? text.substr(begin, at - begin) : std::string();
      };
      const std::string first = number(x, i), second = number(y, k);
      if (first.size() != second.size()) return first.size() < second.size();
      if (first != second) return first < second;
    } else if (x[i] != y[k]) {
      return x[i] < y[k];
    } else {
      ++i, ++k;
    }
  }
  return x.size() - i < y.size() - k;
}

struct Metadata {
  std::vector<std::string> files;
  std::optional<std::int64_t> messages;
};

Metadata read_metadata(const fs::path& file) {
  Metadata metadata;
  const YAML::Node root = YAML::LoadFile(file.string());
  if (!root.IsMap() || !root["rosbag2_bagfile_information"].IsDefined()) return metadata;
  const YAML::Node all = root["rosbag2_bagfile_information"];
  if (!all.IsMap()) return metadata;
  for (const YAML::Node& name : all["relative_file_paths"])
    metadata.files.push_back(name.as<std::string>());
  if (const YAML::Node count = all["message_count"]) metadata.messages = count.as<std::int64_t>();
  return metadata;
}

// With its folder's name or without, packed or not.
std::optional<fs::path> find(const fs::path& folder, const std::string& name) {
  std::error_code error;
  for (const fs::path& path : {folder / name, folder / fs::path(name).filename()}) {
    for (const char* ending : {"", ".zstd"}) {
      const fs::path there = path.string() + ending;
      if (is_bag_file(there) && fs::is_regular_file(there, error)) return there;
    }
  }
  return std::nullopt;
}

}  // namespace

bool is_bag_file(const fs::path& file) {
  std::string ending = lower(file.extension().string());
  if (ending == ".zstd" || ending == ".zst") ending = lower(file.stem().extension().string());
  return ending == ".db3" || ending == ".mcap";
}

BagFiles files_of_bag(const fs::path& folder) {
  BagFiles result;
  std::vector<fs::path> there;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (is_bag_file(entry.path()) && entry.is_regular_file(error)) there.push_back(entry.path());
  }
  std::sort(there.begin(), there.end(), before);
  if (there.empty())
    throw input_error(folder.string(), "", "no .db3 or .mcap file", "a ROS 2 recording");
  const fs::path file = folder / "metadata.yaml";
  Metadata metadata;
  std::string why = fs::exists(file, error) ? "it names no file" : "it is missing";
  try {
    if (fs::exists(file, error)) metadata = read_metadata(file);
  } catch (const YAML::Exception& problem) {
    why = std::string("it cannot be read (") + problem.what() + ")";
  }
  for (const std::string& name : metadata.files) {
    if (auto path = find(folder, name)) result.files.push_back(*path);
  }
  const std::size_t missing = metadata.files.size() - result.files.size();
  if (result.files.empty()) {
    if (!metadata.files.empty()) why = "none of the files it names is here";
    result.problems.push_back(file.string() + ": " + why + ": all files of the folder were read");
    result.files = there;
    return result;
  }
  result.messages = metadata.messages;
  if (missing > 0)
    result.problems.push_back(file.string() + ": names " + std::to_string(metadata.files.size()) +
                              " files of which " + std::to_string(missing) + " are not here");
  for (const fs::path& path : there) {
    const auto same = [&](const fs::path& used) { return fs::equivalent(used, path, error); };
    if (std::none_of(result.files.begin(), result.files.end(), same))
      result.problems.push_back(path.string() + ": not named by metadata.yaml, left out");
  }
  return result;
}

}  // namespace lamina::ros2
