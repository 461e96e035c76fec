// Breadth-first search over frames.
#include <lamina/sensors/transform_tree.hpp>

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

}  // namespace lamina
