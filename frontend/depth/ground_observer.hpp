// Which cells of the ground one image shows as floor, as raised, or as nothing where floor would
// be.
#pragma once

#include <span>

#include <lamina/frontend/depth/low_obstacles.hpp>
#include <lamina/frontend/depth/plane_extractor.hpp>
#include <lamina/models/ground_look.hpp>

namespace lamina {

/// Compares pixels with the dominant floor in disparity, patches of 8 x 2 at once; patches that are
/// not all floor in squares of 2 x 2, of which those beyond three standard errors (what
/// neighbouring pixels share included) of the local floor are something else. Upright planes that
/// reach above what low obstacles are stay out of it, and so does what is too far to tell the cell
/// it is in.
class GroundObserver {
 public:
  explicit GroundObserver(const FloorOptions& options) : options_(options) {}
  /// `reference`: by plane, the plane that its cells are compared with (its own index: a floor of
  /// its own), -1: no floor. `local_floor`: above the dominant floor, by cell of result.surface.
  /// Empty where there is no dominant floor.
  GroundLook look(const PlaneExtractor& extractor, const FloorResult& result,
                  std::span<const int> reference, const LocalFloor& local_floor);

 private:
  /// Squares of 2 x 2 of one cell that lie on one side of the floor.
  struct Side {
    float squares = 0, x = 0, y = 0;  ///< sums over them
    float proven = 0, sigma = 0;      ///< m from the floor that the furthest of them proves
    void add(const Eigen::Vector3f& p, float from_floor, float sigma_of_it);
  };
  struct Count {
    float floor = 0;  ///< pixels
    Side up, down;
  };
  class Walk;

  FloorOptions options_;
  std::vector<Count> counts_;
};

}  // namespace lamina
