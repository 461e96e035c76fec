// Counts of what a reader left out, by reason, and the first case of each.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include <lamina/models/skipped.hpp>

namespace lamina {

class SkipCounts {
 public:
  /// `where`: this case's place within the source, and what was found there.
  void add(const std::string& why, std::int64_t count = 1, const std::string& where = {}) {
    if (count <= 0) return;
    counts_[why] += count;
    if (!where.empty()) firsts_.try_emplace(why, source_ + where);
  }
  /// What stands before the places that follow, such as "scans.csv:".
  void set_source(std::string source) { source_ = std::move(source); }
  /// The first case with a place; empty when there is none.
  std::string first(const std::string& why) const {
    const auto found = firsts_.find(why);
    return found == firsts_.end() ? std::string() : found->second;
  }
  /// The first case of each reason that has a place.
  const std::map<std::string, std::string>& firsts() const { return firsts_; }
  const SkippedCounts& counts() const { return counts_; }
  /// " (3 x short line, first scans.csv:7: ...)"; empty where nothing was left out.
  std::string summary(const std::string& before_first = ", first ") const {
    std::string text;
    for (const auto& [why, count] : counts_) {
      text += (text.empty() ? " (" : ", ") + std::to_string(count) + " x " + why;
      if (!first(why).empty()) text += before_first + first(why);
    }
    return text.empty() ? text : text + ")";
  }
  std::int64_t total() const {
    std::int64_t sum = 0;
    for (const auto& [why, count] : counts_) sum += count;
    return sum;
  }

 private:
  SkippedCounts counts_;
  std::map<std::string, std::string> firsts_;
  std::string source_;
};

/// Reasons used by more than one reader, so that they read alike in reports.
inline constexpr const char* kSkipMissingFile = "missing file";
inline constexpr const char* kSkipTimeBack = "time goes back";
inline constexpr const char* kSkipShortLine = "short line";
inline constexpr const char* kSkipNotANumber = "not a number";
inline constexpr const char* kSkipRangeLimits = "range_max not above range_min";
inline constexpr const char* kSkipBeyondTurn = "scan over more than one turn";
inline constexpr const char* kSkipCutScan = "cut scan line";
inline constexpr const char* kSkipBadImage = "damaged image";
inline constexpr const char* kSkipWrongFormat = "wrong image format";
inline constexpr const char* kSkipWrongSize = "wrong image size";
inline constexpr const char* kSkipNoPartner = "no partner in time";

}  // namespace lamina
