// Pieces of ground in one view that touch without a step: one surface with a roughness.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lamina/backend/association/association.hpp>

namespace lamina {

struct ConnectedGroundOptions {
  /// Ground that swells is one floor with a roughness; false: a plane for every piece of it.
  bool enabled = true;
  double max_slope_deg = 10;  ///< of a piece, on the body: ground that robots drive
  double touch_m = 0.2;       ///< pieces whose outlines come this near touch
  /// Pieces that stand above each other by more than this and three sigmas where they touch are
  /// two: twice what surfaces deviate from planes by.
  double step_m = 0.008;
  /// Heights of ground go together over so much (m): what is nearer is no independent evidence.
  double correlation_m = 0.7;
  /// Ground swells where what is seen nearer than `near_m` lies off the very pieces it is cut into
  /// by more than this (m, rms): the pieces are no planes. Floors that are built plane and ramps
  /// lie off theirs by a millimetre.
  double swell_m = 0.0025;
  double near_m = 2.5;
  double memory_views = 20;  ///< views that say whether ground swells, about so many
  double min_views = 2;      ///< so many say nothing yet
  double slack = 0.8;        ///< of swell_m: ground that swelled goes on to there

  double patch_m = 0.2;             ///< side of a patch, the front-end's
  std::size_t min_patches = 10;     ///< fewer say nothing of a floor's shape
  double off_piece_m = 0.03;        ///< a patch further off a piece than this is not of it
  double beside_piece_m = 0.1;      ///< nor one this far outside of its outline
  double border_step_m = 0.05;      ///< between places where borders are compared
  double first_roughness_m = 0.01;  ///< to begin with, of patches' weights
};

/// Ground of one view, in the body frame of its measurement.
struct GroundView {
  std::vector<std::size_t> pieces;  ///< places in the view's evidence, the floor itself first
  PlaneEvidence joined;             ///< all of it as one plane; its noise floor is the first's
  double area = 0;                  ///< m^2 of patches
  double roughness = 0;             ///< m, rms of its patches off that plane, less their own noise
  /// The same of patches near the body off the pieces they lie on; nullopt: too few.
  std::optional<double> within_pieces;
};

/// What touches the dominant floor of a view without a step, through any number of pieces.
/// `patches_body`: moments of small pieces of floor. nullopt where there is no dominant floor (with
/// `any_first`: no ground at all), or too few patches of it to say.
std::optional<GroundView> connected_ground(std::span<const PlaneEvidence> evidence,
                                           std::span<const Moments> patches_body, bool any_first,
                                           const ConnectedGroundOptions& options);

/// Whether ground swells, by views of late.
class GroundWatch {
 public:
  void add(const std::optional<GroundView>& view, const ConnectedGroundOptions& options);
  bool swells() const { return swells_; }
  /// m, rms off a plane, of views of late.
  double roughness() const;
  /// The view's ground as one plane: how far ground of this roughness lies off its planes by is in
  /// the noise floor, shared by what is nearer than it goes together over.
  PlaneEvidence as_one(const GroundView& view, const ConnectedGroundOptions& options) const;
  /// By how much ground of this roughness tilts and lifts a body that drives `way` (m) on it:
  /// variances to add to a planar motion's (z; roll and pitch).
  Eigen::Vector2d lift_variances(double way, const ConnectedGroundOptions& options) const;

 private:
  bool swells_ = false;
  double views_ = 0, within_ = 0, roughness_ = 0;  // sums of squares, discounted
};

}  // namespace lamina
