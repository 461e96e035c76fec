// Who looks on while a recording is mapped: progress, pictures, and when to stop.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include <lamina/frontend/frontend.hpp>
#include <lamina/models/diagnostics.hpp>

namespace lamina {

class Mapper;
struct MapResult;

/// Thrown within a run where a stage is ended because no time is left for it.
struct EndedEarly {};

/// What a run asks and reports, from the thread that called it. Every member does nothing unless it
/// is overridden; none may change the run's results.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// True ends the reading: what was read so far is mapped.
  virtual bool should_stop() const { return false; }
  /// s until the caller has to have the result, infinity: no hurry. Stages begin nothing long and
  /// end early once it is finite.
  virtual double seconds_left() const { return std::numeric_limits<double>::infinity(); }
  bool hurried() const { return seconds_left() < std::numeric_limits<double>::infinity(); }

  /// There is something to write from here on.
  virtual void on_first_step() {}
  /// A stage of `total` measurements or steps begins (nullopt: not known how many).
  virtual void on_stage(std::optional<std::int64_t> total) { static_cast<void>(total); }
  virtual void on_progress(std::int64_t done, std::int64_t planes) {
    static_cast<void>(done), static_cast<void>(planes);
  }
  virtual void on_stage_end() {}
  /// A step that is not mapped yet: the path by dead reckoning.
  virtual void on_read(const Step& step, const Diagnostics& diagnostics) {
    static_cast<void>(step), static_cast<void>(diagnostics);
  }
  virtual void on_mapped(const Step& step, const Mapper& mapper, const Diagnostics& diagnostics) {
    static_cast<void>(step), static_cast<void>(mapper), static_cast<void>(diagnostics);
  }
  virtual void on_refining(const Mapper& mapper, const Diagnostics& diagnostics) {
    static_cast<void>(mapper), static_cast<void>(diagnostics);
  }
  /// In a hurry, before the grids are drawn: path and planes are there.
  virtual void on_path(const MapResult& result) { static_cast<void>(result); }
};

}  // namespace lamina
