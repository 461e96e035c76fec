// Maps at rest, checked and joined.
#include <lamina/backend/mapper/map_state.hpp>

#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

// Raises ids of another map beyond those of this one.
struct Offsets {
  std::int64_t keyframe = 0, plane = 0, surfel = 0, extrinsics = 0;

  void raise(KeyframeId& id) const { add(id, keyframe); }
  void raise(PlaneId& id) const { add(id, plane); }
  void raise(SurfelId& id) const { add(id, surfel); }
  void raise(ExtrinsicsId& id) const { add(id, extrinsics); }
  template <class Id>
  Id raised(Id id) const {
    raise(id);
    return id;
  }

 private:
  template <class Id>
  static void add(Id& id, std::int64_t offset) {
    if (id != Id::kNone) id = static_cast<Id>(static_cast<std::int64_t>(id) + offset);
  }
};

template <class T>
void extend(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

// How the tangent coordinates of a plane change when it is turned: d_before = J d_after.
Eigen::Matrix3d turned_tangent(const Plane& before, const SO3& R, const Plane& after) {
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.topLeftCorner<2, 2>() =
      before.tangent_basis().transpose() * R.inverse().matrix() * after.tangent_basis();
  return J;
}

void move_plane(PlaneLandmark& plane, const SE3& T) {
  const Plane before = plane.plane_anchor;
  plane.plane_anchor = Plane(T.so3() * before.normal(), before.rho());
  plane.anchor_map = T * plane.anchor_map;
  plane.T_map_outline = T * plane.T_map_outline;
  if (!plane.covariance) return;
  const Eigen::Matrix3d J = turned_tangent(before, T.so3(), plane.plane_anchor).inverse();
  plane.covariance = Eigen::Matrix3d(J * *plane.covariance * J.transpose());
}

void move_prior(MarginalPrior& prior, const SE3& T) {
  for (SE3& pose : prior.poses_linear) pose = T * pose;
  auto column = static_cast<Eigen::Index>(6 * prior.keyframes.size());
  for (Plane& plane : prior.planes_linear) {
    const Plane before = plane;
    plane = Plane(T.so3() * before.normal(), before.rho());
    prior.sqrt_information.middleCols<3>(column) *= turned_tangent(before, T.so3(), plane);
    column += 3;
  }
}

void carry_states(Graph& graph, const Offsets& ids, const SE3& T) {
  for (auto& k : graph.keyframes) {
    ids.raise(k.id);
    k.T_map_body = T * k.T_map_body;
    k.fixed = false;
  }
  for (auto& p : graph.planes) {
    ids.raise(p.id);
    ids.raise(p.merged_into);
    move_plane(p, T);
  }
  for (auto& s : graph.surfels) {
    ids.raise(s.id);
    ids.raise(s.anchor);
    ids.raise(s.parent);
  }
  for (auto& e : graph.extrinsics) ids.raise(e.id);
}

void carry_views(Graph& graph, const Offsets& ids) {
  for (auto& f : graph.plane_moments) {
    ids.raise(f.keyframe);
    ids.raise(f.plane);
    ids.raise(f.extrinsics);
    for (SensorMoments& part : f.by_sensor) ids.raise(part.extrinsics);
  }
  for (auto& f : graph.segments) {
    ids.raise(f.keyframe);
    ids.raise(f.plane);
  }
}

void carry_factors(Graph& graph, const Offsets& ids, const SE3& T) {
  const auto pairs = [&ids](auto& factors) {
    for (auto& f : factors) {
      ids.raise(f.from);
      ids.raise(f.to);
      if constexpr (requires { f.extrinsics; }) ids.raise(f.extrinsics);
    }
  };
  pairs(graph.odometry);
  pairs(graph.planar_odometry);
  pairs(graph.loops);
  for (auto& f : graph.priors) {  // of joined maps; a single one's datum is a fixed keyframe
    ids.raise(f.keyframe);
    f.T_map_body = T * f.T_map_body;
  }
  carry_views(graph, ids);
  for (auto& f : graph.gravity) ids.raise(f.keyframe);
  for (auto& f : graph.surfel_moments) {
    ids.raise(f.keyframe);
    ids.raise(f.surfel);
  }
  for (auto& f : graph.surfel_parents) {
    ids.raise(f.surfel);
    ids.raise(f.plane);
  }
  for (auto& f : graph.marginal_priors) {
    for (auto& id : f.keyframes) ids.raise(id);
    for (auto& id : f.planes) ids.raise(id);
    for (auto& id : f.surfels) ids.raise(id);
    move_prior(f, T);
  }
}

// All of a graph, ids raised and moved by T.
Graph carried(Graph graph, const Offsets& ids, const SE3& T) {
  carry_states(graph, ids, T);
  carry_factors(graph, ids, T);
  return graph;
}

// Height, roll and pitch in the map's axes; x, y and heading are the walls' to say.
PriorFactor level_prior(const Keyframe& k) {
  constexpr double kHeight = 0.03, kTilt = 0.5 * M_PI / 180;  // m, rad
  PriorFactor f{k.id, k.T_map_body, Matrix6d::Zero()};
  const Eigen::Matrix3d R = k.T_map_body.so3().matrix();
  f.sqrt_information.row(2).head<3>() = R.row(2) / kHeight;
  f.sqrt_information.bottomRightCorner<2, 3>() = R.topRows<2>() / kTilt;
  return f;
}

void extend(Graph& a, const Graph& b, const Graph& ids_of) {
  extend(a.keyframes, b.keyframes);
  extend(a.planes, b.planes);
  extend(a.surfels, b.surfels);
  extend(a.extrinsics, b.extrinsics);
  extend(a.odometry, b.odometry);
  extend(a.planar_odometry, b.planar_odometry);
  extend(a.loops, b.loops);
  extend(a.priors, b.priors);
  extend(a.plane_moments, b.plane_moments);
  extend(a.segments, b.segments);
  extend(a.gravity, b.gravity);
  extend(a.surfel_moments, b.surfel_moments);
  extend(a.surfel_parents, b.surfel_parents);
  extend(a.marginal_priors, b.marginal_priors);
  a.next_keyframe += ids_of.next_keyframe;
  a.next_plane += ids_of.next_plane;
  a.next_surfel += ids_of.next_surfel;
  a.next_extrinsics += ids_of.next_extrinsics;
}

// The weak prior of the plane that went is about an anchor that is no more.
void merge(MapState& map, PlaneId from, PlaneId into) {
  map.graph.merge_planes(from, into);
  std::erase_if(map.graph.marginal_priors, [from](const MarginalPrior& p) {
    return std::find(p.planes.begin(), p.planes.end(), from) != p.planes.end();
  });
  auto& pieces = map.outlines[into];
  extend(pieces, map.outlines[from]);
  map.outlines.erase(from);
  if (!map.partial.count(from)) map.partial.erase(into);
  map.partial.erase(from);
}

}  // namespace

void append(MapState& a, const MapState& b, const MapOverlap& overlap) {
  const Offsets ids{a.graph.next_keyframe, a.graph.next_plane, a.graph.next_surfel,
                    a.graph.next_extrinsics};
  const std::size_t first = a.graph.keyframes.size();
  extend(a.graph, carried(b.graph, ids, overlap.T_a_b), b.graph);
  if (!overlap.level && first < a.graph.keyframes.size()) {
    a.graph.priors.push_back(level_prior(a.graph.keyframes[first]));
  }
  for (MapFrame frame : b.frames) {
    ids.raise(frame.keyframe);
    a.frames.push_back(frame);
  }
  for (const auto& [id, T_map_body] : b.left_window) {
    a.left_window[ids.raised(id)] = overlap.T_a_b * T_map_body;
  }
  for (const auto& [id, pieces] : b.outlines) {
    auto& into = a.outlines[ids.raised(id)] = pieces;
    for (auto& piece : into) ids.raise(piece.keyframe);
  }
  for (const PlaneId id : b.partial) a.partial.insert(ids.raised(id));
  for (const auto& [id, points] : b.loose_body) a.loose_body[ids.raised(id)] = points;
  a.surfels.append(b.surfels, ids.keyframe);
  for (const auto& [of_b, into] : overlap.planes) {
    const PlaneId from = ids.raised(of_b);
    if (a.graph.at(from).active && a.graph.at(into).active) merge(a, from, into);
  }
}

std::vector<std::string> MapState::problems() const {
  std::vector<std::string> all = graph.problems();
  const auto known = [&](KeyframeId id) { return graph.find(id) != nullptr; };
  for (const MapFrame& frame : frames) {
    if (!known(frame.keyframe)) all.emplace_back("a frame hangs on a keyframe that is not there");
  }
  for (const auto& [id, pieces] : outlines) {
    if (graph.find(id) == nullptr) all.emplace_back("an outline is of a plane that is not there");
  }
  const auto is_covariance = [](const Eigen::Matrix3d& C) {
    return C.allFinite() && (C.diagonal().array() >= 0).all();
  };
  if (!is_covariance(extrinsics_covariance))
    all.emplace_back("the doubt of mountings is no covariance");
  if (!is_covariance(wheel_covariance)) all.emplace_back("the doubt of wheels is no covariance");
  return all;
}

}  // namespace lamina
