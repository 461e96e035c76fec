// "Did you mean ...": the nearest of some names.
#pragma once

#include <string>
#include <vector>

namespace lamina::apps {

/// The candidate with the least edit distance to `name`; empty when none is near (more than a third
/// of its letters would change, and at least two).
std::string nearest(const std::string& name, const std::vector<std::string>& candidates);

}  // namespace lamina::apps
