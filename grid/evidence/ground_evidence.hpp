// What images saw on the ground, by the refined path: low things that stand, floor that is not
// there.
#pragma once

#include <vector>

#include <lamina/grid/evidence/looks.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/models/spool.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

/// Things too small for a surfel, and places where lines of sight pass the floor's plane, over many
/// images. A place counts where three images or more marked it, and more than those that, from no
/// further than half as far again as the nearest of them, saw plain floor there: noise does not
/// come back to its place, and what moved away is taken back.
class GroundVotes {
 public:
  /// `folder`: where the looks are kept on disk.
  explicit GroundVotes(const std::filesystem::path& folder = std::filesystem::temp_directory_path())
      : looks_(folder) {}
  /// `T_body_levelled`: the look's frame in the body.
  void add(Timestamp stamp, const GroundLook& look, const SE3& T_body_levelled);
  /// Puts what counts into the map, which holds the planes and the path, at most one of each kind
  /// for each cell of `resolution` m. Raised: two loose points, at the height (m, above the ground
  /// plane there) that the nearest looks prove, and halfway up: one alone would be noise. Sunk by
  /// more than `max_step` m: an end of knowledge.
  void put_into(PlanarMap& map, const Trajectory& trajectory, double resolution,
                double max_step) const;

  /// All that was added (archived SeenGround), for sessions, and back.
  const Spool& seen() const { return looks_; }
  Spool& seen() { return looks_; }
  void take(const std::vector<SeenGround>& seen);

 private:
  Spool looks_;
};

}  // namespace lamina
