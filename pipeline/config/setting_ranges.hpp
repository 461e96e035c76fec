// Values of numeric settings that make sense at all.
#pragma once

#include <optional>
#include <string>

namespace lamina {

struct SettingRange {
  double low = 0, high = 0;  ///< both allowed; in the unit people type
};

/// nullopt for settings that are no numbers, and the seed.
std::optional<SettingRange> range_of(const std::string& key);

/// Throws std::invalid_argument saying what is expected where a number in the setting's text, or
/// one of several, is out of its range. What is no number at all, the setting's own reader says.
void require_in_range(const std::string& key, const std::string& value);

}  // namespace lamina
