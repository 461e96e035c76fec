// Values of numeric settings that make sense at all.
#pragma once

#include <optional>
#include <string>

namespace lamina::apps {

struct SettingRange {
  double low = 0, high = 0;  ///< both allowed; in the unit people type
};

/// nullopt for settings that are no numbers, and the seed.
std::optional<SettingRange> range_of(const std::string& key);

}  // namespace lamina::apps
