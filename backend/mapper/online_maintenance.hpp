// When a map that grows online is set right as a whole.
#pragma once

#include <cstdint>

#include <lamina/backend/mapper/mapper.hpp>

namespace lamina {

/// The window keeps the newest part of the map right; this says when the rest has its turn, so that
/// neither a loop's contradiction stays in the map nor laps of one place fill the memory.
class OnlineUpkeep {
 public:
  /// After each Mapper::add. Every ten metres or so the floor of these is made one; that of many
  /// laps between refinements, too. Not before: loops still bend the map, and floor that hangs on
  /// far keyframes bends with those.
  void added(const AddResult& added, Mapper& mapper);
  /// After the graph took `loops` new loops. The whole graph is due when one of them says that it
  /// is wrong, or it has grown by a tenth since it was last refined, or half as much was seen again
  /// (without loops: as much): then evidence of laps is made one.
  bool due(int loops, const Mapper& mapper) const;
  /// Refines the graph, without a second hearing for what was left out, and makes its floor one.
  void refine(Mapper& mapper);

 private:
  std::size_t refined_at_ = 0;  // keyframes there were
  std::size_t met_ = 0;         // keyframes since then, those taken out again among them
  std::size_t met_in_all_ = 0;
};

}  // namespace lamina
