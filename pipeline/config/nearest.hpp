// "Did you mean ...": the nearest of some names.
#pragma once

#include <string>
#include <vector>

namespace lamina {

/// The candidate with the least edit distance to `name`; empty when none is near (more than a third
/// of its letters would change, and at least two).
std::string nearest(const std::string& name, const std::vector<std::string>& candidates);

/// ": did you mean 'NEAR'?", the end of a line about something that is not known.
inline std::string did_you_mean(const std::string& near) {
  return ": did you mean '" + near + "'?";
}

}  // namespace lamina
