// A list of measurements as a recording.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <lamina/sensors/recording.hpp>

namespace lamina::testing {

class ListedRecording final : public Recording {
 public:
  explicit ListedRecording(std::vector<Measurement> all) : all_(std::move(all)) {}
  std::optional<Measurement> next() override {
    return i_ < all_.size() ? std::optional(all_[i_++]) : std::nullopt;
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }

 private:
  std::vector<Measurement> all_;
  std::size_t i_ = 0;
  Calibration calibration_;
};

}  // namespace lamina::testing
