// Observations in, map out: the one function that reads like the textbook. Online and offline
// alike.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include <lamina/backend/mapper/keyframe_retirement.hpp>
#include <lamina/backend/mapper/localization.hpp>
#include <lamina/backend/mapper/map_drawing.hpp>
#include <lamina/backend/mapper/plane_formation.hpp>
#include <lamina/backend/mapper/plane_merging.hpp>
#include <lamina/backend/mapper/window_surfels.hpp>
#include <lamina/backend/parameters/extrinsics_estimation.hpp>
#include <lamina/backend/refine/refiner.hpp>

namespace lamina {

/// What one call of Mapper::add did.
struct AddResult {
  KeyframeId keyframe = KeyframeId::kNone;  ///< the keyframe that carries this frame
  bool is_keyframe = false;
  SE3 T_map_body;  ///< now
  /// One for each plane, then each segment of the observations.
  std::vector<AssociationDecision> decisions;
  std::vector<PlaneId> new_planes;                  ///< that had evidence enough now
  std::vector<std::pair<PlaneId, PlaneId>> merged;  ///< (from, into)
  bool loop_closed = false;            ///< old planes were recognised: refine() pays off
  std::optional<WindowReport> window;  ///< of keyframes
  double associate_ms = 0, window_ms = 0;
};

class Mapper {
 public:
  explicit Mapper(const MapperOptions& options = {});
  /// A map at rest, to refine and to draw; nothing of it is in the window.
  Mapper(const MapperOptions& options, MapState map);
  /// The map at rest: planes carry the covariance that is known of them now.
  MapState state() const;

  /// One depth frame or scan. `T_prev_body` is the body's motion since the last add() (the first:
  /// T_map_body itself) with its covariance in the right tangent (translation, rotation).
  /// Observations may be empty: the pose is kept. Nothing in the data makes it throw.
  /// `motion_of_sensor`: it was measured by what this sensor saw (scans matched, images), so that
  /// it depends on where the sensor sits.
  AddResult add(const Observations& observations, const SE3& T_prev_body,
                const Matrix6d& increment_covariance, bool motion_of_sensor = false);
  /// A motion between two keyframes from place recognition or scan matching. It may be wrong: the
  /// refiner decides. False when a keyframe is not there (any more).
  /// `sensor`: a state of the graph, if that sensor's own motion was measured.
  bool add_loop(KeyframeId from, KeyframeId to, const SE3& T_from_to, const Matrix6d& covariance,
                ExtrinsicsId sensor = ExtrinsicsId::kNone);

  /// A factor of a user's own on keyframes and states of the map: in the window as long as all that
  /// it reads are keyframes there, and in every refinement. Its keyframes stay (they are not
  /// retired). Throws lamina::Error where it does not fit the map, saying how.
  void add_factor(const CustomFactor& factor);
  /// A state of a user's own, for factors to read. Throws lamina::Error for numbers that cannot be.
  CustomStateId add_state(const CustomState& state);
  /// The keyframe that carries the frame nearest in time to `stamp`, and that frame's pose in it;
  /// nullopt: no frame within `tolerance_s`.
  std::optional<MapFrame> keyframe_at(Timestamp stamp, double tolerance_s = 0.2) const;

  /// Refines the whole graph and makes outlines and frames anew from it; the window goes on from
  /// there.
  RefineResult refine(RefineOptions options = {},
                      const std::function<bool(const RefineProgress&)>& progress = {});

  /// Gives planes the exact covariances of the graph as it was last refined, poses' errors and all;
  /// until then they carry what the window left them with, or what their own evidence says.
  void know_covariances();

  /// How sure it is where sensors sit on the body: covariance of (x, y, heading; m, rad) of all of
  /// them together (by_mounting). Planes of map() say it; nothing is estimated by it.
  void set_extrinsics_covariance(const Eigen::Matrix3d& covariance) {
    parameters_.extrinsics = covariance;
  }

  /// Wheels alone told the path: covariance of how they err in all motions by scale, drift (rad/m)
  /// and turn scale (moved_by_wheels), the graph being as it was last refined. Planes of map() say
  /// it, and path_sigma(); nothing is estimated by it.
  void set_wheel_covariance(const Eigen::Matrix3d& covariance) {
    parameters_.set_wheels(map_.graph, covariance);
  }
  /// m, 1-sigma: root mean square over keyframes of how far they are off from the first pose, by
  /// the graph as it was last refined and by set_wheel_covariance(). nullopt where that cannot be
  /// told.
  std::optional<double> path_sigma() const { return lamina::path_sigma(map_.graph, parameters_); }

  /// Floor evidence of keyframes beyond the window that lie within `radius_m` of an older one hangs
  /// on that one from here on, at the poses of now, and every place of the floor on one keyframe:
  /// what many laps saw takes the room of one. Of keyframes that the last refine() laid out, where
  /// neighbours hang together well; right after it, or when laps have added to them.
  void condense_floor(double radius_m = 1) { retirement_.condense_floor(map_, radius_m); }
  /// The same for what came since, and since this was last asked: keyframes that follow each other
  /// hang together well enough wherever the next refine() puts them, not with what was there
  /// before. And for what keyframes that went left to older ones which the last refine() laid out.
  /// To be asked every few metres.
  void condense_newest_floor(double radius_m = 1) {
    retirement_.condense_newest_floor(map_, radius_m);
  }
  /// Takes out keyframes that had to stay when they left the window, as planes of theirs were new:
  /// asked once more, when planes that turned out to be one are merged.
  void retire_again() { retirement_.retire_again(map_); }
  /// Keyframes beyond the window for which an older one could stand in, were it known how far from
  /// it they lie, and that planes of theirs which seem new are known: not until refine() has spread
  /// the path's drift and merged what turned out to be one.
  std::size_t waiting() const { return retirement_.waiting(); }

  /// What a long run keeps of every frame goes to a file without a name in this folder; its bytes
  /// come back as they were.
  void keep_frames_in(const std::filesystem::path& folder) { map_.frames.keep_in(folder); }

  /// Where sensors sit, estimated together with poses and planes of the graph as it was last
  /// refined (lamina::estimate_extrinsics); the map stays what it is. nullopt where that says
  /// nothing: on ground that swells the body's height and tilt are free, and would teach the camera
  /// its own.
  std::optional<ExtrinsicsEstimate> estimate_extrinsics(const ExtrinsicsOptions& options) const;

  /// Everything in another map frame, as one body. Not with factors of a user's own, which may say
  /// where the map is (std::logic_error).
  void move(const SE3& T_new_map);

  /// Takes a merge back: `from` is a plane of its own again with the evidence it had. False when it
  /// was not merged, or that has stood through two refine(). What the window's prior has taken in
  /// stays with the other plane.
  bool undo_merge(PlaneId from) { return merging_.undo(map_, from); }

  SE3 current_pose() const;             ///< T_map_body at the last add()
  Matrix6d current_covariance() const;  ///< in its right tangent
  PlanarMap map() const { return draw_map(map_, parameters_); }
  /// T_map_body at every add(), by present estimates.
  Trajectory trajectory() const { return draw_path(map_); }
  /// T_map_body at every add(), as each left the window: what a robot had at the time.
  Trajectory online_trajectory() const { return draw_path(map_, true); }
  const Graph& graph() const { return map_.graph; }
  const MapperOptions& options() const { return map_.options; }

 private:
  struct Step;  // one call of add()

  // The steps of add(), in this order.
  void predict(Step& step) const;
  void join_ground(Step& step);
  bool wants_keyframe(const Step& step) const;
  void start_keyframe(Step& step);
  void gather(Step& step);
  void solve_window(Step& step);
  void tidy(Step& step);

  WorkingMap map_;
  PlaneFormation formation_;                     // planes before they enter the map
  PlaneMerging merging_;                         // planes that are one
  KeyframeRetirement retirement_;                // keyframes that are not needed
  WindowSurfels window_surfels_;                 // cells of floors that are no planes
  ParameterUncertainty parameters_;              // of extrinsics and wheels
  BodyInKeyframe odometry_;                      // by odometry alone: what factors may use
  BodyInKeyframe estimate_;                      // with what this frame saw
  ExtrinsicsId moved_by_ = ExtrinsicsId::kNone;  // whose motion it was since the last keyframe
  std::int64_t keyframes_made_ = 0;
};

}  // namespace lamina
