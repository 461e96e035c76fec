// What lines of sight went through does not stand there: people who walked on, by the refined path.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include <lamina/grid/evidence/looks.hpp>
#include <lamina/models/planar_map.hpp>
#include <lamina/models/spool.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

/// Votes of depth images, and of scans beside them, for and against what stands in a map
/// (place_votes.hpp).
class SightVotes {
 public:
  using ForEachScan = std::function<void(const std::function<void(const KeptScan&)>&)>;

  /// `folder`: where the looks are kept on disk.
  explicit SightVotes(const std::filesystem::path& folder = std::filesystem::temp_directory_path())
      : looks_(folder) {}
  /// Keeps five looks a second.
  void add(Timestamp stamp, const DepthLook& look, const SE3& T_body_camera);
  /// Takes away what is not there any more: loose points in cells of `resolution` m that are free
  /// again (where something was met in passing alone, an end of knowledge is left); upright planes
  /// no larger than people of which more squares of 10 cm are no wall than are, ground beside
  /// their foot left out. Nothing where a tenth of the large ones is no wall: the path is wrong.
  /// The same for any number of threads.
  void withdraw(PlanarMap& map, const Trajectory& trajectory, double resolution,
                const ForEachScan& for_each_scan = {}, int threads = 1) const;

  /// All that was added (archived SeenDepth), for sessions, and back.
  const Spool& seen() const { return looks_; }
  Spool& seen() { return looks_; }
  void take(const std::vector<SeenDepth>& seen);

 private:
  Spool looks_;
  std::optional<Timestamp> last_;
};

}  // namespace lamina
