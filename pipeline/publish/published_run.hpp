// `lamina map --publish`: a run whose map is sent to ROS 2, too.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <lamina/pipeline/map_result.hpp>
#include <lamina/pipeline/publish/map_publisher.hpp>
#include <lamina/pipeline/run_observer.hpp>
#include <lamina/sensors/recording_source.hpp>

namespace lamina {

/// Hands everything on to `observer`. A file is replayed at `rate` times the time in which it was
/// recorded: no step comes before its time.
class PublishedRun final : public RunObserver {
 public:
  /// `source` and `options` are those of the run: odometry is noted as it is read, and the run is
  /// online. Throws lamina::Error where there is no DDS.
  PublishedRun(RecordingSource& source, MapOptions& options, double rate, RunObserver& observer);

  /// The map as it is written; nothing where there is no time for it.
  void finished(const MapResult& result);

  bool should_stop() const override { return observer_.should_stop(); }
  double seconds_left() const override { return observer_.seconds_left(); }
  void on_first_step() override { observer_.on_first_step(); }
  void on_stage(std::optional<std::int64_t> total) override { observer_.on_stage(total); }
  void on_progress(std::int64_t done, std::int64_t planes) override {
    observer_.on_progress(done, planes);
  }
  void on_stage_end() override { observer_.on_stage_end(); }
  void on_read(const Step& step, const Diagnostics& diagnostics) override {
    observer_.on_read(step, diagnostics);
  }
  void on_mapped(const Step& step, const Mapper& mapper, const Diagnostics& diagnostics) override;
  void on_refining(const Mapper& mapper, const Diagnostics& diagnostics) override {
    observer_.on_refining(mapper, diagnostics);
  }
  void on_path(const MapResult& result) override { observer_.on_path(result); }

 private:
  void wait_for(Timestamp stamp);

  RunObserver& observer_;
  bool live_;
  double rate_;
  std::optional<Timestamp> first_;
  std::chrono::steady_clock::time_point began_;
  std::unique_ptr<publish::MapPublisher> publisher_;
};

}  // namespace lamina
