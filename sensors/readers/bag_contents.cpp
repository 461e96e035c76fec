// One pass over all topics.
#include <lamina/sensors/readers/bag_contents.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include <lamina/models/median.hpp>
#include <lamina/sensors/readers/bag_bodies.hpp>
#include <lamina/sensors/readers/bag_roles.hpp>
#include <lamina/sensors/readers/input_kind.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/readers/transform_tree.hpp>

namespace lamina {
namespace {

using bag::Kind;
using bag::Message;

double degrees(double radians) { return radians * 180 / M_PI; }

struct TopicContent {
  bag::Topic topic;
  std::vector<std::int64_t> stamps;  // ns
  std::set<std::string> frames;
  std::int64_t damaged = 0;
  std::string detail;  // of the first message
  std::string use;
};

struct Transforms {
  struct Edge {
    bool fixed = false;
    std::int64_t count = 0;
  };
  std::map<std::string, std::map<std::string, Edge>> children;  // parent -> child
  std::set<std::string> below;                                  // frames that have a parent
  TransformTree tree;
  std::string body;  // of the odometry

  void add(const Message& m) {
    const std::string parent = frame_name(m.frame), child = frame_name(m.child_frame);
    Edge& edge = children[parent][child];
    edge.fixed = m.topic == "/tf_static";
    ++edge.count;
    below.insert(child);
    tree.add(parent, child, SE3());
  }
};

std::string detail_of(const Message& m) {
  switch (m.kind) {
    case Kind::kScan: {
      const auto step = static_cast<double>(m.angle_increment);
      return fmt::format("{} beams over {:.1f} deg from {:.1f} deg, {:.2f} to {:.2f} m",
                         m.ranges.size(),
                         degrees(std::abs(step) * static_cast<double>(m.ranges.size())),
                         degrees(static_cast<double>(m.angle_min)), m.range_min, m.range_max);
    }
    case Kind::kDepth:
      return fmt::format("{} x {} px, {}", m.width, m.height, m.encoding);
    case Kind::kCloud:
      return m.height > 1 ? fmt::format("{} x {} points, organised", m.width, m.height)
                          : fmt::format("{} points", m.width);
    case Kind::kCameraInfo:
      return fmt::format("{} x {} px, fx {:.1f} fy {:.1f} cx {:.1f} cy {:.1f}", m.width, m.height,
                         m.intrinsics[0], m.intrinsics[1], m.intrinsics[2], m.intrinsics[3]);
    case Kind::kOdometry:
      return "body '" + m.child_frame + "'";
    default:
      return m.encoding.empty() ? "" : fmt::format("{} x {} px, {}", m.width, m.height, m.encoding);
  }
}

// Role of its type; of images, whether they are depth.
std::string use_of(const TopicContent& content, const Message& first, bool read) {
  if (!content.topic.unread.empty()) return "not read: " + content.topic.unread;
  const std::string role = bag::role_of_type(content.topic.type);
  if (role.empty()) return "type not read";
  if (role == "stream") return "nothing is mapped with it yet";
  if (role == "image") return first.kind == Kind::kDepth ? "depth" : "no depth image";
  return read ? role : role + ", damaged";
}

void add(TopicContent& content, const Message& m, bool read) {
  if (content.use.empty() || (content.detail.empty() && read)) {
    content.detail = detail_of(m);
    content.use = use_of(content, m, read);
  }
  content.damaged += read || bag::role_of_type(content.topic.type) == "image" ? 0 : 1;
  content.stamps.push_back(m.stamp_ns);
  if (!m.frame.empty()) content.frames.insert(frame_name(m.frame));
}

struct Rhythm {
  double rate = 0, gap = 0, gap_at = 0;  // Hz, s, s from the first message of all
};

Rhythm rhythm_of(std::vector<std::int64_t> stamps, std::int64_t first) {
  Rhythm rhythm;
  std::sort(stamps.begin(), stamps.end());
  std::vector<double> periods;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    periods.push_back(1e-9 * static_cast<double>(stamps[i] - stamps[i - 1]));
    if (periods.back() <= rhythm.gap) continue;
    rhythm.gap = periods.back();
    rhythm.gap_at = 1e-9 * static_cast<double>(stamps[i - 1] - first);
  }
  if (periods.empty()) return rhythm;
  const double period = median(periods);
  rhythm.rate = period > 0 ? 1 / period : 0;
  return rhythm;
}

std::string table(const std::map<std::string, TopicContent>& topics, std::int64_t first) {
  std::size_t name = 5, type = 4;
  for (const auto& [key, content] : topics) {
    name = std::max(name, content.topic.name.size());
    type = std::max(type, content.topic.type.size());
  }
  std::string text = fmt::format("{:<{}}  {:<{}}  {:>8} {:>9} {:>14} {:>9}  frame, use\n", "topic",
                                 name, "type", type, "count", "rate Hz", "longest gap s", "at s");
  for (const auto& [key, content] : topics) {
    const Rhythm rhythm = rhythm_of(content.stamps, first);
    std::string frames;
    for (const std::string& frame : content.frames)
      frames += (frames.empty() ? "'" : ", '") + frame + "'";
    text += fmt::format("{:<{}}  {:<{}}  {:>8} {:>9.2f} {:>14.3f} {:>9.3f}  {}{}\n",
                        content.topic.name, name, content.topic.type, type, content.topic.count,
                        rhythm.rate, rhythm.gap, rhythm.gap_at, frames.empty() ? "" : frames + ", ",
                        content.use.empty() ? "no message" : content.use);
    if (!content.detail.empty()) text += "    " + content.detail + "\n";
    if (content.damaged > 0) text += fmt::format("    {} x damaged message\n", content.damaged);
  }
  return text;
}

void print_below(const Transforms& transforms, const std::string& frame, std::size_t depth,
                 std::set<std::string>& printed, std::string& text) {
  const auto children = transforms.children.find(frame);
  if (children == transforms.children.end() || depth > 60) return;
  for (const auto& [child, edge] : children->second) {
    text += std::string(2 * depth, ' ') + child +
            (edge.fixed ? "  (fixed)\n" : fmt::format("  (moves, {} x)\n", edge.count));
    if (printed.insert(child).second) print_below(transforms, child, depth + 1, printed, text);
  }
}

std::string tree_of(const Transforms& transforms,
                    const std::map<std::string, TopicContent>& topics) {
  std::string text = "transforms\n";
  std::set<std::string> printed;
  for (const auto& [parent, children] : transforms.children) {
    if (transforms.below.count(parent) > 0) continue;
    text += "  " + parent + "\n";
    print_below(transforms, parent, 2, printed, text);
  }
  if (transforms.children.empty()) text += "  none\n";
  std::string body = transforms.body;
  for (const char* frame : {"base_footprint", "base_link"})
    if (body.empty() && transforms.tree.has(frame)) body = frame;
  std::set<std::string> missing;
  for (const auto& [name, content] : topics) {
    if (content.use != "scan" && content.use != "depth" && content.use != "cloud") continue;
    for (const std::string& frame : content.frames) {
      if (!transforms.tree.lookup(body, frame))
        missing.insert("  missing: " + transforms.tree.missing_link(body, frame) + "\n");
    }
  }
  for (const std::string& line : missing) text += line;
  return text;
}

}  // namespace

std::string describe_bag(bag::Source& source) {
  using Status = bag::Source::Status;
  std::map<std::string, TopicContent> topics;
  std::vector<std::string> names;
  for (const bag::Topic& topic : source.topics()) {
    topics[topic.name].topic = topic;
    names.push_back(topic.name);
  }
  Transforms transforms;
  std::optional<std::int64_t> first;
  if (!names.empty()) source.select(names);
  Message m;
  for (auto status = names.empty() ? Status::kEnd : source.next(m); status != Status::kEnd;
       status = source.next(m)) {
    add(topics[m.topic], m, status == Status::kMessage);
    if (m.kind == Kind::kTransform) transforms.add(m);
    if (m.kind == Kind::kOdometry && transforms.body.empty())
      transforms.body = frame_name(m.child_frame);
    if (m.topic != "/tf_static") first = std::min(first.value_or(m.stamp_ns), m.stamp_ns);
  }
  std::string text = table(topics, first.value_or(0)) + tree_of(transforms, topics);
  for (const std::string& problem : source.problems()) text += "damaged   " + problem + "\n";
  return text;
}

std::string describe_bag(const std::string& input) {
  std::error_code error;
  const std::filesystem::path path(input);
  if (!std::filesystem::exists(path, error) ||
      std::filesystem::exists(path / "calibration.yaml", error))
    return {};
  const std::string ending = ending_of(path);
  const bool folder = std::filesystem::is_directory(path, error);
  std::unique_ptr<bag::Source> source;
  if (!folder && ending == ".bag") {
    source = open_rosbag_messages(input);
  } else if (is_ros2(path) || (!folder && (ending == ".db3" || ending == ".mcap"))) {
    source = open_ros2_messages(path);
  }
  return source ? describe_bag(*source) : std::string();
}

}  // namespace lamina
