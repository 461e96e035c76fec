// Places met again: submaps of scans matched against older submaps.
#pragma once

#include <deque>
#include <filesystem>
#include <optional>
#include <vector>

#include <lamina/frontend/loops/planar_pose_graph.hpp>
#include <lamina/frontend/loops/submap_store.hpp>
#include <lamina/frontend/motion/likelihood_grid.hpp>
#include <lamina/frontend/motion/line_matcher.hpp>
#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/frontend/motion/submap.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

struct LoopCloserOptions {
  double submap_length = 3.0;     ///< m travelled: a submap sees enough to be told from others
  double submap_turn = 4.0;       ///< rad turned in all, likewise (turning on the spot)
  double key_translation = 0.25;  ///< m between the scans whose points a submap takes
  double key_rotation = 0.2;      ///< rad, likewise
  double thin_cell = 0.06;        ///< m; points of a submap nearer together add nothing
  double max_range = 20;          ///< m from the scanner
  int min_gap = 3;                ///< submaps in between: neighbours overlap without a loop
  int max_candidates = 3;         ///< older submaps tried for each new one: bounds the time
  double overlap_distance = 6;    ///< m between centres at which submaps still share a view
  double gate_sigmas = 3;         ///< search window and gate, in sigmas of the drift since then
  double min_window = 0.4, max_window = 12;         ///< m
  double min_window_yaw = 0.1, max_window_yaw = 1;  ///< rad
  double resolution = 0.1;                          ///< m a cell of the search grid
  int search_points = 350;                          ///< of the new submap, evenly thinned
  double min_score = 0.45;         ///< mean likelihood of the search's best, 0 to 1
  double max_ambiguity = 0.8;      ///< second best elsewhere / best: above, several places look so
  double min_matched = 0.45;       ///< after refinement: points that lie on the older map's lines
  double min_agreement = 0.85;     ///< views of points that do not contradict, both ways
  double agreement_margin = 0.25;  ///< m
  double max_chi_squared = 25;     ///< 3 dof, against the drift: beyond, the loop is not believed
  /// A match between submaps is off by this at best (their own bend): m, rad, 1-sigma.
  double sigma_translation = 0.02, sigma_rotation = 0.004;
  /// Submaps kept of one place and heading; a later one that matched is let go, and one that did
  /// not (a place that looks like another) when there are twice as many. 0: all are kept. What is
  /// let go leaves the graph, too, without keep_path.
  int visits = 0;
  bool keep_path = true;  ///< every scan's pose, for corrected()
};

struct LoopClosure {
  Timestamp from, to;                      ///< `from` is the older
  SE3 T_from_to;                           ///< of the body
  Matrix6d covariance = Matrix6d::Zero();  ///< right tangent (translation, rotation)
  double score = 0;                        ///< fraction of points that match, 0 to 1
};

template <class A>
void fields(A& a, LoopClosure& v) {
  a(v.from, v.to, v.T_from_to, v.covariance, v.score);
}

/// Takes each scan with its motion and gives loops when a submap has been completed. Old places are
/// found by search_correlative() in a window as large as the drift since then, refused when a
/// second place looks alike, refined by match_lines(), and refused when any direction stays open,
/// when views contradict (SightFan), or when the graph of submaps cannot be reconciled.
/// [Olson2009], [Hess2016]. Deterministic.
class LoopCloser {
 public:
  explicit LoopCloser(const LoopCloserOptions& options = {});
  /// What submaps saw goes to a file without a name in this folder; loops are the same. To be
  /// called before anything else.
  void keep_submaps_in(const std::filesystem::path& folder) { store_.keep_in(folder); }
  std::vector<LoopClosure> add(const LaserScan& scan, const ScanMotion& motion);
  /// Completes the last submap and looks for older ones of its place.
  std::vector<LoopClosure> finish();

  /// T_map_body at every scan so far, by odometry and all loops; the first is the identity. Empty
  /// without keep_path.
  Trajectory corrected() const;
  /// A scan of this stamp began a submap: loops lead from and to such scans alone.
  bool starts_submap(Timestamp stamp) const;
  struct Counts {
    int submaps = 0, tried = 0, found = 0, ambiguous = 0, unmatched = 0, open_direction = 0,
        contradicted = 0, inconsistent = 0, accepted = 0, passed = 0;
    template <class A>
    friend void fields(A& a, Counts& v) {
      a(v.submaps, v.tried, v.found, v.ambiguous, v.unmatched, v.open_direction, v.contradicted,
        v.inconsistent, v.accepted, v.passed);
    }
  };
  const Counts& counts() const { return counts_; }
  /// Poses that are estimated.
  int estimated() const { return graph_.estimated(); }
  /// Memory that the points and views of submaps hold.
  std::size_t bytes() const;

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, LoopCloser& v) {
    a(v.submaps_, v.newest_, v.store_, v.graph_, v.scans_, v.cache_, v.T_anchor_body_,
      v.T_anchor_key_, v.key_scans_, v.free_way_, v.counts_);
    if constexpr (A::kReading) v.remake_grids();
  }

 private:
  struct ScanPose {
    Timestamp stamp;
    int submap;
    PlanarPose T_anchor_body;
    double progress;  ///< m and rad moved since the anchor: how much of its error has grown
    template <class A>
    friend void fields(A& a, ScanPose& v) {
      a(v.stamp, v.submap, v.T_anchor_body, v.progress);
    }
  };
  struct Candidate {
    int submap;
    PlanarPose T_old_new;
    Eigen::Matrix3d covariance;
    double farthest;  ///< m that their centres may lie apart: of equal distance, the surer
  };
  struct OldMap {
    int submap = -1;
    PointMap points;
    LikelihoodGrid grid{{}, 0.1, 0.1, 1};
    std::vector<SightFan> fans;
    template <class A>
    friend void fields(A& a, OldMap& v) {
      a(v.submap, v.points, v.fans);
    }
  };

  void start_submap(Timestamp stamp);
  void extend_submap(const LaserScan& scan);
  std::vector<LoopClosure> complete_submap();
  std::vector<Candidate> candidates(int submap) const;
  const OldMap& old_map(int submap, int newer);
  LikelihoodGrid search_grid(const std::vector<OrientedPoint>& points) const;
  void remake_grids();
  std::optional<PlanarEdge> match(const Candidate& candidate, int submap, double& score);
  bool accept(const PlanarEdge& edge);
  bool known_well(int submap, int times) const;
  void let_go(int submap);
  void pass(int submap);
  std::vector<LoopClosure> close(int submap);
  LoopClosure lifted_loop(const PlanarEdge& edge, double score) const;

  LoopCloserOptions options_;
  std::vector<Submap> submaps_;
  SubmapViews newest_;  // of the last submap
  SubmapStore store_;   // of those before it
  PlanarPoseGraph graph_;
  std::vector<ScanPose> scans_;
  std::deque<OldMap> cache_;
  PlanarPose T_anchor_body_, T_anchor_key_;
  int key_scans_ = 0;
  bool free_way_ = false;  // no kept submap is held by the edge that leads to the newest
  Counts counts_;
};

}  // namespace lamina
