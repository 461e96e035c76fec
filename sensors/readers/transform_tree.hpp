// Fixed transforms between named frames.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>

#include <lamina/models/lie/se3.hpp>

namespace lamina {

/// An undirected graph of frames; the first transform given between two frames stays.
class TransformTree {
 public:
  void add(const std::string& parent, const std::string& child, const SE3& T_parent_child);
  bool has(const std::string& frame) const { return edges_.count(frame) > 0; }
  /// T_from_to along the fewest edges; the identity when the names are equal; nullopt when the
  /// frames are not connected.
  std::optional<SE3> lookup(const std::string& from, const std::string& to) const;
  /// "tf has no link between 'base_link' (with 'base_footprint') and 'laser' (alone)".
  std::string missing_link(const std::string& from, const std::string& to) const;

 private:
  std::set<std::string> connected(const std::string& frame) const;

  std::map<std::string, std::map<std::string, SE3>> edges_;  // T_outer_inner
};

}  // namespace lamina
