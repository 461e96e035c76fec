// Breadth-first search over frames.
#include <lamina/sensors/readers/transform_tree.hpp>

#include <deque>

namespace lamina {

void TransformTree::add(const std::string& parent, const std::string& child,
                        const SE3& T_parent_child) {
  if (parent == child) return;
  if (edges_[parent].emplace(child, T_parent_child).second) {
    edges_[child].emplace(parent, T_parent_child.inverse());
  }
}

std::optional<SE3> TransformTree::lookup(const std::string& from, const std::string& to) const {
  if (from == to) return SE3();
  std::map<std::string, SE3> reached{{from, SE3()}};
  std::deque<std::string> open{from};
  while (!open.empty()) {
    const std::string frame = open.front();
    open.pop_front();
    const auto neighbours = edges_.find(frame);
    if (neighbours == edges_.end()) continue;
    for (const auto& [next, T_frame_next] : neighbours->second) {
      const SE3 T_from_next = reached.at(frame) * T_frame_next;
      if (!reached.emplace(next, T_from_next).second) continue;
      if (next == to) return T_from_next;
      open.push_back(next);
    }
  }
  return std::nullopt;
}

std::set<std::string> TransformTree::connected(const std::string& frame) const {
  std::set<std::string> reached{frame};
  std::deque<std::string> open{frame};
  while (!open.empty()) {
    const auto neighbours = edges_.find(open.front());
    open.pop_front();
    if (neighbours == edges_.end()) continue;
    for (const auto& [next, T] : neighbours->second)
      if (reached.insert(next).second) open.push_back(next);
  }
  return reached;
}

std::string TransformTree::missing_link(const std::string& from, const std::string& to) const {
  constexpr std::size_t kMostNames = 4;
  const auto with = [this](const std::string& frame) {
    if (frame.empty()) return std::string("a body frame, which nothing names");
    std::string text = "'" + frame + "' (";
    std::set<std::string> others = connected(frame);
    others.erase(frame);
    if (others.empty()) return text + "alone)";
    std::size_t named = 0;
    for (const std::string& other : others) {
      if (named++ < kMostNames) text += (named > 1 ? ", '" : "with '") + other + "'";
    }
    if (named > kMostNames) text += " and " + std::to_string(named - kMostNames) + " more";
    return text + ")";
  };
  return "tf has no link between " + with(from) + " and " + with(to);
}

}  // namespace lamina
