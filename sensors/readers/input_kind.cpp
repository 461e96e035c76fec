// First bytes and names.
#include <lamina/sensors/readers/input_kind.hpp>

#include <array>
#include <fstream>
#include <utility>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/carmen_log.hpp>
#include <lamina/sensors/readers/compressed_text.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {

std::string lower(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

std::string first_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes(512, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  return bytes;
}

bool begins(const std::string& text, std::string_view with) {
  return std::string_view(text).substr(0, with.size()) == with;
}

}  // namespace

std::string ending_of(const std::filesystem::path& path) {
  const std::string ending = lower(path.extension().string());
  if (ending == ".gz" || ending == ".bz2" || ending == ".zst" || ending == ".zstd") {
    return lower(path.stem().extension().string());
  }
  return ending;
}

bool is_ros2(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return begins(first_bytes(path), "\x89MCAP");
  for (const auto& entry : std::filesystem::directory_iterator(path, error)) {
    const std::string ending = ending_of(entry.path());
    if (ending == ".db3" || ending == ".mcap") return true;
  }
  return std::filesystem::exists(path / "metadata.yaml", error);
}

InputKind kind_of_input(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return {};
  const std::string bytes = first_bytes(path), ending = lower(path.extension().string());
  if (begins(bytes, "\x89MCAP"))
    return {"a ROS 2 recording (MCAP)", "the same file renamed to .mcap"};
  if (begins(bytes, "SQLite format 3"))
    return {"an SQLite database", "a ROS 2 recording: the same file renamed to .db3"};
  if (begins(bytes, "#ROSBAG V2")) {
    return {"a ROS 1 bag that is not called .bag", "the same file renamed to .bag"};
  }
  const bool packed = compression_of(path) != Compression::kNone || begins(bytes, "PK\x03\x04") ||
                      begins(bytes, "7z\xbc\xaf") ||
                      begins(bytes,
                             "\xfd"
                             "7zXZ") ||
                      begins(bytes, "Rar!") || ending == ".tar" || ending == ".lz4";
  if (packed) {
    return {"a compressed file or archive (" + ending + ")",
            "what is in it: unpack it first (only .log, .clf, .db3 and .mcap are read compressed)"};
  }
  return {};
}

bool seems_carmen(const std::filesystem::path& file) {
  TextBytes begin;
  if (compression_of(file) == Compression::kNone) {
    begin.text = first_bytes(file);
  } else {
    try {
      begin = read_text_bytes(file);
    } catch (const Error&) {
      return false;
    }
  }
  std::string_view line;
  int words = 0, carmen = 0;
  for (LineReader lines(begin.text); words < 50 && lines.next(line);) {
    if (is_comment(line)) continue;
    ++words;
    carmen += carmen_tag(line).kind != CarmenKind::kOther ? 1 : 0;
  }
  return carmen > 0 && 2 * carmen >= words;
}

InputKind kind_of_bag(const std::filesystem::path& file, const std::string& why) {
  const std::string bytes = first_bytes(file);
  if (begins(bytes, "#ROSBAG V1")) {
    return {"a bag of version 1", "version 2.0: convert it with `rosbag fix`"};
  }
  if (!begins(bytes, "#ROSBAG V2")) {
    InputKind kind = kind_of_input(file);
    if (kind.found.empty()) kind.found = "a file that does not begin as a bag does";
    if (kind.advice.empty()) kind.advice = "a ROS 1 bag, version 2.0";
    return kind;
  }
  if (why.find("unindexed") != std::string::npos || why.find("index") != std::string::npos) {
    return {"a bag without an index (its recorder was stopped before it closed the file)",
            "an indexed bag: run `rosbag reindex " + file.filename().string() + "`"};
  }
  return {"a bag that is cut short or damaged (" + why + ")",
          "a whole ROS 1 bag: try `rosbag reindex`, or copy the file again"};
}

}  // namespace lamina
