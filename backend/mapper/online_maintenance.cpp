// Counts of keyframes met and kept.
#include <lamina/backend/mapper/online_maintenance.hpp>

#include <algorithm>

#include <lamina/backend/graph/loop_agreement.hpp>

namespace lamina {
namespace {

constexpr std::size_t kCondenseEvery = 25;  // keyframes, some 10 m
constexpr std::size_t kManyLaps = 3;        // keyframes met for each that is kept
constexpr double kGrown = 1.1;              // the graph, since it was last refined

}  // namespace

void OnlineUpkeep::added(const AddResult& added, Mapper& mapper) {
  if (!added.is_keyframe) return;
  ++met_;
  ++met_in_all_;
  if (met_in_all_ % kCondenseEvery != 0) return;
  mapper.condense_newest_floor();
  if (met_in_all_ > kManyLaps * mapper.graph().keyframes.size()) mapper.condense_floor();
}

bool OnlineUpkeep::due(int loops, const Mapper& mapper) const {
  // What waits for its refinement was seen again.
  const std::size_t keyframes = mapper.graph().keyframes.size() - mapper.waiting();
  const std::size_t grown = keyframes - std::min(keyframes, refined_at_);
  const std::size_t again = met_ - std::min(met_, grown);
  if (loops <= 0) return again > keyframes;
  return 2 * again > keyframes ||
         static_cast<double>(keyframes) > kGrown * static_cast<double>(refined_at_) ||
         !newest_loops_agree(mapper.graph(), loops);
}

void OnlineUpkeep::refine(Mapper& mapper) {
  refined_at_ = mapper.graph().keyframes.size();
  met_ = 0;
  RefineOptions quick;
  quick.thorough = false;
  mapper.refine(quick);
  mapper.retire_again();
  mapper.condense_floor();
}

}  // namespace lamina
