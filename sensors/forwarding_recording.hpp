// A recording behind another: all of it passes through, but for what a derived class changes.
#pragma once

#include <memory>
#include <utility>

#include <lamina/sensors/recording.hpp>

namespace lamina {

class ForwardingRecording : public Recording {
 public:
  explicit ForwardingRecording(std::unique_ptr<Recording> source) : source_(std::move(source)) {}

  std::optional<Measurement> next() override { return source_->next(); }
  std::optional<DepthFrame> next_depth(std::int64_t skip) override {
    return source_->next_depth(skip);
  }
  std::optional<Measurement> next_light() override { return source_->next_light(); }
  const Calibration& calibration() const override { return source_->calibration(); }
  SkippedCounts skipped() const override { return source_->skipped(); }
  std::map<std::string, std::string> first_skipped() const override {
    return source_->first_skipped();
  }
  std::map<std::string, std::vector<Timestamp>> recorded_stamps() const override {
    return source_->recorded_stamps();
  }
  std::vector<std::string> assumed() const override { return source_->assumed(); }
  std::map<Timestamp, Timestamp> restamped() const override { return source_->restamped(); }
  std::vector<std::string> remarks() const override { return source_->remarks(); }
  std::vector<Warning> warnings() const override { return source_->warnings(); }
  std::optional<std::int64_t> size_hint() const override { return source_->size_hint(); }
  std::optional<std::int64_t> depth_hint() const override { return source_->depth_hint(); }

 protected:
  Recording& source() const { return *source_; }

 private:
  std::unique_ptr<Recording> source_;
};

}  // namespace lamina
