// Counts of what a reader left out, by reason.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace lamina {

class SkipCounts {
 public:
  void add(const std::string& why, std::int64_t count = 1) {
    if (count > 0) counts_[why] += count;
  }
  const std::map<std::string, std::int64_t>& counts() const { return counts_; }
  std::int64_t total() const {
    std::int64_t sum = 0;
    for (const auto& [why, count] : counts_) sum += count;
    return sum;
  }

 private:
  std::map<std::string, std::int64_t> counts_;
};

/// Reasons used by more than one reader, so that they read alike in reports.
inline constexpr const char* kSkipMissingFile = "missing file";
inline constexpr const char* kSkipTimeBack = "time goes back";
inline constexpr const char* kSkipShortLine = "short line";
inline constexpr const char* kSkipNotANumber = "not a number";
inline constexpr const char* kSkipBadImage = "damaged image";
inline constexpr const char* kSkipWrongFormat = "wrong image format";
inline constexpr const char* kSkipWrongSize = "wrong image size";
inline constexpr const char* kSkipNoPartner = "no partner in time";

}  // namespace lamina
