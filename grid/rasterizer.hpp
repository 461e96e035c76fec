// From planes, surfels, edges and loose points to the grid that says where a robot may go.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <lamina/grid/navigability_grid.hpp>
#include <lamina/models/planar_map.hpp>

namespace lamina {

struct RasterOptions {
  double resolution = 0.05;      ///< m, side of a cell
  double robot_height = 0.75;    ///< m: what is higher above the floor does not block
  double max_step = 0.02;        ///< m, T: largest step between neighbouring cells
  double max_slope = 0.1745329;  ///< rad, steepest surface the robot drives
  /// A cell is free where the probability that its step to each neighbour is at most max_step, and
  /// its slope at most max_slope, is at least this; blocked where it is at most one minus this;
  /// between the two the map does not say.
  double min_probability = 0.95;
  /// Factor of slope: from 1 on the level falling linearly to `steep_factor` at `steep_slope`.
  double steep_slope = 0.7853982;  ///< rad, 45 degrees, as the floor article has it
  double steep_factor = 0.2;
  /// How often a wall, a pair of loose points or the rim of a hole in the map is really there: the
  /// confidence of a cell they block. A robot that asks for more goes and looks.
  double obstacle_confidence = 0.95;
  /// Discs are drawn larger by this, where no other disc lies: sqrt(pi/2) lets discs of the area
  /// of squares of a lattice cover the squares' corners.
  double disc_growth = 1.2533;
  /// How well the map knows where an edge lies: paths are good to centimetres, surfels stand for
  /// squares of 0.1 m. Cells this near to one that a step blocks are not called free (8 cells at
  /// most); 0: edges are known exactly.
  double edge_margin = 0.05;
  double level_gap = 0.15;  ///< m: surfaces at one place closer than this are one floor; the higher
                            ///< one counts. Less than a stair's riser, more than a doorstep.
  /// m, side of the patches that surfels are made of. A rise of more than max_step within it, which
  /// no plane explains, may be a step that a patch lies astride: such cells are not called free.
  double patch_size = 0.2;
  /// m: lower steps of the floor are none that discs lie astride.
  double least_step = 0.007;
  /// Of such a step: how even the floor is on either side.
  double least_even = 0.1;
  double plane_gap = 0.075;  ///< m: a plane fills gaps of its surfels this far from them: one of
                             ///< their squares (0.1 m) that has none. What is larger was looked
                             ///< at, and was no floor ...
  double wall_gap = 0.15;   ///< m: ... but this far where a wall stands near: its foot is no floor,
                            ///< and takes pixels of the floor beside it along
  double wall_near = 0.2;   ///< m
  double plane_ring = 0.3;  ///< m: nothing more is filled up to here, and beyond by planes without
                            ///< surfels of their own alone: outlines do not tell holes, but a plane
                            ///< that was looked at has surfels where it is
  double seed_radius = 2.0;      ///< m around the path where floor is looked for: cameras see the
                                 ///< ground from a metre ahead on
  double seed_tolerance = 0.1;   ///< m plus a tenth of the distance from the path: how far that
                                 ///< floor may lie from the body's own height
  double reference_reach = 8.0;  ///< m from the path up to where it tells the floor's height for
                                 ///< places with no connected floor
  /// One line for each setting that cannot be.
  std::vector<std::string> problems() const;
};

/// What changed in a map since the last update, as indices into its lists.
struct RasterChanges {
  std::vector<std::size_t> surfels, planes, edges, loose_points;
};

/// What keeps a cell from being called free or blocked.
enum class UnknownCause {
  kNone,              ///< it is called one of the two
  kNotSeen,           ///< no surface and nothing solid
  kEdge,              ///< an end of knowledge is marked there
  kNeighbourNotSeen,  ///< a cell beside it was not seen
  kStep,              ///< the height of a cell beside it, or its own, is not sure enough
  kHiddenStep,        ///< the floor rises by more than a step within the size of a patch
  kSlope,             ///< its slope is not
  kBesideStep,  ///< beside a cell that a step blocks: nobody knows where exactly its edge lies
  kSqueezed,    ///< between solid things
};

/// What stands or hangs in the robot's height over a cell, map z (m).
struct SolidCell {
  CellIndex cell;
  double floor = 0;          ///< the surface there, else the floor the robot would come from
  double low = 0, high = 0;  ///< its lowest and highest bounds
};

/// Draws a map and redraws only what changed (docs/grid.md explains the rules).
///
/// The grid after any sequence of updates is the same, bit for bit, as one drawn from scratch from
/// the last map: which floor is the robot's is decided by connected components of tiles, which do
/// not depend on the order of events.
class Rasterizer {
 public:
  /// Throws lamina::Error when options.problems() is not empty.
  explicit Rasterizer(const RasterOptions& options = {});
  ~Rasterizer();
  Rasterizer(Rasterizer&&) noexcept;
  Rasterizer& operator=(Rasterizer&&) noexcept;

  /// Finds out itself what changed, by comparing digests of everything: linear in the map.
  /// `map` is not kept.
  void update(const PlanarMap& map);
  /// As above, but looks only at what is listed, at what was appended to or cut from the end of the
  /// lists, and at new poses at the end of the path: linear in the change.
  void update(const PlanarMap& map, const RasterChanges& changes);

  /// Called before each tile that an update draws or judges. It may throw, to end the update: what
  /// is left is half drawn then, and of no more use.
  void before_each_tile(std::function<void()> call);

  const NavigabilityGrid& grid() const;
  NavigabilityGrid take_grid() &&;
  std::size_t tiles_drawn() const;  ///< of the last update, of 32 x 32 cells
  UnknownCause unknown_cause(const CellIndex& cell) const;
  std::vector<SolidCell> solid_cells() const;  ///< tile by tile, then by cell
  bool floor_seen() const;        ///< false: no surface at all in the map, only obstacles
  bool floor_under_path() const;  ///< a surface is where the path says the robot's floor must be

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The map drawn from scratch. Layers (NaN: not known):
/// - height: map z of the highest surface or obstacle a robot there would touch, m;
/// - slope: of the surface, rad;
/// - navigability: height factor times slope factor of the floor article, 0 where the robot cannot
///   be: steps, slopes, obstacles up to its height, ledges, pits and rims;
/// - confidence: probability that the verdict is right.
NavigabilityGrid rasterize(const PlanarMap& map, const RasterOptions& options = {});

}  // namespace lamina
