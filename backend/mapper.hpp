// Observations in, map out: the one function that reads like the textbook. Online and offline
// alike.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include <lamina/backend/association.hpp>
#include <lamina/backend/graph.hpp>
#include <lamina/backend/mapper_options.hpp>
#include <lamina/backend/plane_index.hpp>
#include <lamina/backend/sliding_window.hpp>
#include <lamina/frontend/observation.hpp>
#include <lamina/models/planar_map.hpp>

namespace lamina {

struct RefinerOptions;  // refiner.hpp
struct RefineResult;

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
  RefineResult refine(const RefinerOptions& options);

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
  struct Frame {
    Timestamp stamp;
    KeyframeId keyframe;
    SE3 T_keyframe_body;
  };

  MapperOptions options_;
  Graph graph_;
  SlidingWindow window_;
  std::vector<Frame> frames_;
};

}  // namespace lamina
