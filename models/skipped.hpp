// What was left out of a recording, and how often.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace lamina {

/// How many measurements were left out, by reason, in words for people.
using SkippedCounts = std::map<std::string, std::int64_t>;

}  // namespace lamina
