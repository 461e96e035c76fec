// A run's steps made a map: offline with all of the recording at hand, online step by step.
#pragma once

#include <vector>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/pipeline/loop_factors.hpp>
#include <lamina/pipeline/run_recording.hpp>

namespace lamina {

/// Steps into the mapper, with the record of what each left behind.
class StepMapper {
 public:
  StepMapper(const MapperOptions& options, const LoopCloser& closer, RunRecord& record)
      : mapper(options), closer_(closer), record_(record) {}

  Mapper mapper;

  AddResult add(const Step& step);
  /// How many of the loops the mapper took.
  int transfer(const std::vector<LoopClosure>& loops) { return book_.transfer(loops, mapper); }
  std::int64_t plane_count() const {
    return static_cast<std::int64_t>(mapper.graph().planes.size());
  }

 private:
  const LoopCloser& closer_;
  RunRecord& record_;
  LoopBook book_;
};

/// Dead reckoning and loops over the whole recording first, so that the mapper meets old planes
/// where they are; then what the known path says of sensors, window, loops and refinement.
Mapper map_offline(Run& run);

/// A front-end that maps step by step finds on the way what needs no look ahead.
void begin_online(FrontEnd& front_end, const MapOptions& options);

/// Errors of wheels and scatter of ranges that the front-end found, and what it left out.
void report_front_end(const FrontEnd& front_end, RunRecord& record);

/// What a robot would have had at each instant.
Mapper map_online(Run& run);

}  // namespace lamina
