// Keyframes and floor that laps of one place do not need: the graph grows with the map, not with
// time.
#pragma once

#include <lamina/backend/mapper/working_map.hpp>

namespace lamina {

/// Takes out keyframes beyond the window that an older one can stand in for: their planes are seen
/// from there, their frames and floor hang on the older one, odometry is chained past them. And
/// gathers the floor of many laps on few keyframes.
class KeyframeRetirement {
 public:
  /// Floor up to the keyframe `condensed` is condensed already.
  explicit KeyframeRetirement(KeyframeId condensed = KeyframeId::kNone) : condensed_(condensed) {}

  /// A keyframe that left the window.
  void departed(WorkingMap& map, KeyframeId id);
  /// Asks once more for those that had to stay when they left the window.
  void retire_again(WorkingMap& map);
  /// Of those, for which an older one could stand in (Mapper::waiting()).
  std::size_t waiting() const { return waiting_; }
  /// The graph was refined with the keyframes up to this one.
  void refined(KeyframeId newest) { refined_ = newest; }

  /// Floor evidence of keyframes as Mapper::condense_floor() says; radius in m.
  void condense_floor(WorkingMap& map, double radius_m);
  /// As Mapper::condense_newest_floor().
  void condense_newest_floor(WorkingMap& map, double radius_m);

 private:
  bool retire(WorkingMap& map, KeyframeId id);
  std::vector<KeyframeId> laid_out_floor(const WorkingMap& map) const;
  void condense_successors(WorkingMap& map, double radius_m);

  std::vector<KeyframeId> stayed_;          // beyond the window, since retire_again()
  std::size_t waiting_ = 0;                 // of them
  KeyframeId refined_ = KeyframeId::kNone;  // the newest at the last refinement
  KeyframeId condensed_;                    // the newest whose floor is condensed
  std::set<KeyframeId> successors_;         // given floor of keyframes that went, since then
};

}  // namespace lamina
