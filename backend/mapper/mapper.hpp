// Observations in, map out: the one function that reads like the textbook. Online and offline
// alike.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <lamina/backend/association/association.hpp>
#include <lamina/backend/association/outlines.hpp>
#include <lamina/backend/association/plane_evidence.hpp>
#include <lamina/backend/association/plane_index.hpp>
#include <lamina/backend/graph/graph.hpp>
#include <lamina/backend/mapper/map_state.hpp>
#include <lamina/backend/mapper/mapper_options.hpp>
#include <lamina/backend/mapper/surfel_estimator.hpp>
#include <lamina/backend/parameters/wheel_errors.hpp>
#include <lamina/backend/refine/refiner.hpp>
#include <lamina/backend/solver/window/sliding_window.hpp>
#include <lamina/models/observation.hpp>
#include <lamina/models/planar_map.hpp>

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

/// What undo_merge() needs.
struct MergeRecord {
  PlaneLandmark landmark;
  std::vector<PlaneMomentsFactor> factors;
  std::vector<OutlinePiece> outlines;
  std::vector<MarginalPrior> priors;
  bool stood = false;  ///< through a refine()
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
  AddResult add(const Observations& observations, const SE3& T_prev_body,
                const Matrix6d& increment_covariance);
  /// A motion between two keyframes from place recognition or scan matching. It may be wrong: the
  /// refiner decides. False when a keyframe is not there (any more).
  bool add_loop(KeyframeId from, KeyframeId to, const SE3& T_from_to, const Matrix6d& covariance);

  /// Refines the whole graph and makes outlines and frames anew from it; the window goes on from
  /// there.
  RefineResult refine(const RefineOptions& options = {},
                      const std::function<bool(const RefineProgress&)>& progress = {});

  /// Gives planes the exact covariances of the graph as it was last refined, poses' errors and all;
  /// until then they carry what the window left them with, or what their own evidence says.
  void know_covariances();

  /// How sure it is where sensors sit on the body: covariance of (x, y, heading; m, rad) of all of
  /// them together (by_mounting). Planes of map() say it; nothing is estimated by it.
  void set_extrinsics_covariance(const Eigen::Matrix3d& covariance) {
    extrinsics_covariance_ = covariance;
  }

  /// Wheels alone told the path: covariance of how they err in all motions by scale, drift (rad/m)
  /// and turn scale (moved_by_wheels), the graph being as it was last refined. Planes of map() say
  /// it, and path_sigma(); nothing is estimated by it.
  void set_wheel_covariance(const Eigen::Matrix3d& covariance);
  /// m, 1-sigma: root mean square over keyframes of how far they are off from the first pose, by
  /// the graph as it was last refined and by set_wheel_covariance(). nullopt where that cannot be
  /// told.
  std::optional<double> path_sigma() const;

  /// Floor evidence of keyframes beyond the window that lie within `radius_m` of an older one hangs
  /// on that one from here on, at the poses of now, and every place of the floor on one keyframe:
  /// what many laps saw takes the room of one. Of keyframes that the last refine() laid out, where
  /// neighbours hang together well; right after it, or when laps have added to them.
  void condense_floor(double radius_m = 1);
  /// The same for what came since, and since this was last asked: keyframes that follow each other
  /// hang together well enough wherever the next refine() puts them, not with what was there
  /// before. And for what keyframes that went left to older ones which the last refine() laid out.
  /// To be asked every few metres.
  void condense_newest_floor(double radius_m = 1);
  /// Takes out keyframes that had to stay when they left the window, as planes of theirs were new:
  /// asked once more, when planes that turned out to be one are merged.
  void retire_again();
  /// Keyframes beyond the window for which an older one could stand in, were it known how far from
  /// it they lie, and that planes of theirs which seem new are known: not until refine() has spread
  /// the path's drift and merged what turned out to be one.
  std::size_t waiting() const { return waiting_; }

  /// What a long run keeps of every frame goes to a file without a name in this folder; its bytes
  /// come back as they were.
  void keep_frames_in(const std::filesystem::path& folder) { frames_.keep_in(folder); }

  /// Everything in another map frame, as one body.
  void move(const SE3& T_new_map);

  /// Takes a merge back: `from` is a plane of its own again with the evidence it had. False when it
  /// was not merged, or that has stood through two refine(). What the window's prior has taken in
  /// stays with the other plane.
  bool undo_merge(PlaneId from);

  SE3 current_pose() const;             ///< T_map_body at the last add()
  Matrix6d current_covariance() const;  ///< in its right tangent
  PlanarMap map() const;
  /// T_map_body at every add(), by present estimates.
  Trajectory trajectory() const;
  /// T_map_body at every add(), as each left the window: what a robot had at the time.
  Trajectory online_trajectory() const;
  const Graph& graph() const { return graph_; }
  const MapperOptions& options() const { return options_; }

 private:
  // What level scans drew where the ground rises into their plane is ground.
  void drop_strokes_on_ground(std::vector<MapPlane>& planes) const;
  void part_walls(std::vector<MapPlane>& planes) const;
  PlaneLandmark part_of(PlaneId id, const OutlineGrid& outline) const;
  // The body relative to its keyframe, with covariance in the right tangent.
  struct Relative {
    SE3 T_keyframe_body;
    Matrix6d covariance = Matrix6d::Zero();
    void advance(const SE3& T_prev_body, const Matrix6d& covariance_increment);
  };
  // A plane that has not shown itself often enough yet.
  struct Tentative {
    PlaneLandmark landmark;
    double tilt_sigma = 0;          // rad, of the prior on its tilt
    std::set<std::int64_t> tracks;  // of the front-end
    std::map<KeyframeId, PlaneViews> evidence;
    KeyframeId last = KeyframeId::kNone;
  };
  // Which plane the front-end's track is of.
  struct TrackLink {
    PlaneId plane = PlaneId::kNone;
    KeyframeId last = KeyframeId::kNone;  // when it was seen
  };
  struct Step;  // one call of add()

  // One step of add() each, in this order.
  void predict(Step& step) const;
  void associate_all(Step& step);
  void associate_together(Step& step);
  void look_again(Step& step);
  std::optional<std::vector<AssociationDecision>> supposed(const Step& step, std::size_t index,
                                                           const AssociationCandidate& candidate);
  /// Of two views of one moment that went to one plane and cannot be of one: the worse is let go.
  void part_what_one_view_tells_apart(Step& step) const;
  bool wants_keyframe(const Step& step) const;
  void start_keyframe(Step& step);
  void gather(Step& step);
  Relative located(const Relative& predicted, const Step& step) const;
  void localize(Step& step);
  void solve_window(Step& step);
  void tidy(Step& step);

  std::vector<AssociationCandidate> candidates(const PlaneEvidence& evidence,
                                               const SE3& T_map_body);
  void drop_beyond_gaps(const PlaneEvidence& evidence, const SE3& T_map_body,
                        std::vector<AssociationCandidate>& near) const;
  std::vector<AssociationCandidate> tentative_candidates(const SE3& T_map_body) const;
  AssociationDecision associate_one(std::size_t index, const Step& step);
  std::optional<std::size_t> forming_plane(std::size_t index, const Step& step,
                                           const std::vector<AssociationCandidate>& young) const;
  std::optional<PlaneId> followed_plane(std::int64_t track) const;
  void link_track(std::int64_t track, PlaneId plane);
  Eigen::Matrix<double, 9, 9> relative_covariance(PlaneId id) const;
  void add_to_plane(PlaneId id, const PlaneEvidence& evidence_keyframe, Timestamp stamp);
  void add_to_tentative(std::size_t index, const PlaneEvidence& evidence_keyframe,
                        std::int64_t track, Timestamp stamp);
  void refit(Tentative& tentative) const;
  void hold_first_floor(PlaneId id);
  std::size_t hold_fallen();
  std::size_t stand_up_fallen();
  bool hold(PlaneId id, const Plane& at_anchor, double sigma_tilt, double sigma_rho);
  std::optional<PlaneId> promote(Tentative& tentative);
  void ensure_in_window(PlaneId id, const PlaneEvidence& evidence);
  Moments factor_moments(const PlaneEvidence& evidence) const;
  Moments factor_moments(const PlaneViews& views) const;
  std::vector<std::pair<PlaneId, PlaneId>> merge_coplanar();
  using PlanePairs = std::set<std::pair<PlaneId, PlaneId>>;
  RefineResult settle_planes(RefineResult result, const RefineOptions& options,
                             const std::function<bool(const RefineProgress&)>& progress);
  std::size_t part_rejected(const std::vector<FactorRef>& rejected, PlanePairs& apart);
  std::size_t merge_lines();
  std::vector<std::pair<PlaneId, PlaneId>> merge_refined(const PlanePairs& apart);
  std::size_t test_shifts(const RefineResult& refined, const RefineOptions& options,
                          const std::function<bool(const RefineProgress&)>& progress);
  std::size_t test_merges(const RefineResult& refined, const RefineOptions& options,
                          const PlanePairs& apart,
                          const std::function<bool(const RefineProgress&)>& progress);
  void join_planes(PlaneId from, PlaneId into);
  std::size_t undo_contradicted(const std::vector<std::pair<PlaneId, PlaneId>>& merged,
                                PlanePairs& apart);
  std::size_t drop_unsupported();
  bool recognise();
  void close_loop(const SE3& T_old_new, const std::vector<std::pair<PlaneId, PlaneId>>& pairs);
  void remember_merge(PlaneId from);
  void absorb(PlaneId from, PlaneId into);
  void share_outlines(PlaneId old, PlaneId made);
  const Keyframe* nearest_older(const Keyframe& keyframe) const;
  bool stands_in(const Keyframe& other, const Keyframe& keyframe) const;
  bool retire(KeyframeId id);
  std::vector<KeyframeId> laid_out_floor() const;
  void condense_floor_about(const std::set<KeyframeId>& keyframes, double radius_m);
  void remake_outlines();
  MapPlane map_plane(const PlaneLandmark& plane) const;

  MapperOptions options_;
  Graph graph_;
  SlidingWindow window_;
  PlaneIndex index_;
  FrameLog frames_;
  std::map<KeyframeId, SE3> left_window_;    // T_map_body as each keyframe left
  KeyframeId keyframe_ = KeyframeId::kNone;  // the present one
  Relative odometry_;                        // by odometry alone: what factors may use
  Relative estimate_;                        // with what this frame saw
  Matrix6d keyframe_covariance_ = Matrix6d::Identity();
  // What the present keyframe saw of planes, its body frame, undiscounted: the noise floor counts
  // once however many frames join.
  std::map<PlaneId, PlaneViews> gathered_;
  std::map<PlaneId, Eigen::Matrix<double, 9, 9>> joint_;  // with the present keyframe's pose
  std::vector<Tentative> tentatives_;
  std::map<std::int64_t, TrackLink> tracks_;
  std::map<PlaneId, std::vector<OutlinePiece>> outlines_;
  std::set<PlaneId> partial_;              // seen by segments alone
  PlaneId first_floor_ = PlaneId::kNone;   // held where the frames say,
  std::optional<Plane> first_floor_map_;   // which is here
  std::map<PlaneId, MergeRecord> merges_;  // by the plane that went
  SurfelEvidence surfels_;
  std::vector<KeyframeId> stayed_;  // beyond the window, since retire_again()
  std::size_t waiting_ = 0;         // of them
  std::map<KeyframeId, std::vector<Eigen::Vector3d>> loose_body_;
  Eigen::Matrix3d extrinsics_covariance_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d wheel_covariance_ = Eigen::Matrix3d::Zero();
  MovedByWheels
      by_wheels_;  // by that, as know_covariances() or set_wheel_covariance() found the graph
  std::int64_t keyframes_made_ = 0;
  KeyframeId refined_ = KeyframeId::kNone;    // the newest at the last refine()
  KeyframeId condensed_ = KeyframeId::kNone;  // the newest whose floor is condensed
  std::set<KeyframeId> successors_;           // given floor of keyframes that went, since then
};

}  // namespace lamina
