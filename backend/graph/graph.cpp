// Graph: states and factors, found by id, added, merged and taken out.
#include <lamina/backend/graph/graph.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

template <class State, class Id>
auto find_state(State& states, Id id) -> decltype(states.data()) {
  // Ids rise by one unless states were taken out: the guess is right nearly always.
  const auto guess = static_cast<std::size_t>(id);
  if (guess < states.size() && states[guess].id == id) return &states[guess];
  const auto it = std::lower_bound(states.begin(), states.end(), id,
                                   [](const auto& state, Id wanted) { return state.id < wanted; });
  return it != states.end() && it->id == id ? &*it : nullptr;
}

template <class State, class Id>
bool erase_state(std::vector<State>& states, Id id) {
  State* state = find_state(states, id);
  if (state == nullptr) return false;
  states.erase(states.begin() + (state - states.data()));
  return true;
}

template <class Id>
bool holds(const std::vector<Id>& ids, Id id) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

std::size_t erase_custom_of(std::vector<CustomFactor>& factors, KeyframeId id) {
  return std::erase_if(factors,
                       [id](const CustomFactor& f) { return holds(f.states, StateRef(id)); });
}

}  // namespace

const char* to_string(FactorType type) {
  constexpr const char* kNames[] = {"odometry",      "planar_odometry", "loop",    "prior",
                                    "plane_moments", "segment",         "gravity", "surfel_moments",
                                    "surfel_parent", "marginal_prior",  "custom"};
  static_assert(std::size(kNames) == kFactorTypes);
  return kNames[static_cast<int>(type)];
}

PlaneLandmark PlaneLandmark::at(const Plane& plane_map, const Eigen::Vector3d& near_map) {
  PlaneLandmark landmark;
  landmark.anchor_map = plane_map.project(near_map);
  landmark.plane_anchor = plane_map.about(landmark.anchor_map);
  landmark.T_map_outline = plane_frame(plane_map, landmark.anchor_map);
  return landmark;
}

Plane PlaneLandmark::plane_map() const { return plane_anchor.about(-anchor_map); }

void PlaneLandmark::set_plane_anchor(const Plane& plane_anchor_new) {
  plane_anchor = plane_anchor_new;
  const Eigen::Vector3d old_normal = T_map_outline.so3() * Eigen::Vector3d::UnitZ();
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond::FromTwoVectors(old_normal, plane_anchor.normal());
  const SO3 rotation = SO3(turn) * T_map_outline.so3();
  T_map_outline = SE3(rotation, anchor_map + plane_anchor.project(Eigen::Vector3d::Zero()));
}

KeyframeId Graph::add_keyframe(Timestamp stamp, const SE3& T_map_body) {
  Keyframe keyframe;
  keyframe.id = KeyframeId(next_keyframe++);
  keyframe.stamp = stamp;
  keyframe.T_map_body = T_map_body;
  keyframes.push_back(keyframe);
  return keyframe.id;
}

PlaneId Graph::add_plane(PlaneLandmark plane) {
  plane.id = PlaneId(next_plane++);
  planes.push_back(std::move(plane));
  return planes.back().id;
}

SurfelId Graph::add_surfel(SurfelLandmark surfel) {
  surfel.id = SurfelId(next_surfel++);
  surfels.push_back(std::move(surfel));
  return surfels.back().id;
}

Extrinsics Extrinsics::at(std::string sensor, const SE3& T_body_sensor) {
  Extrinsics e;
  e.sensor = std::move(sensor);
  e.T_body_sensor = e.state = e.prior = T_body_sensor;
  return e;
}

bool Extrinsics::held_as_made() const {
  return !estimate && state.translation() == T_body_sensor.translation() &&
         state.so3().quaternion().coeffs() == T_body_sensor.so3().quaternion().coeffs();
}

ExtrinsicsId Graph::add_extrinsics(Extrinsics sensor) {
  sensor.id = ExtrinsicsId(next_extrinsics++);
  extrinsics.push_back(std::move(sensor));
  return extrinsics.back().id;
}

CustomStateId Graph::add_custom_state(CustomState state) {
  state.id = CustomStateId(next_custom_state++);
  custom_states.push_back(std::move(state));
  return custom_states.back().id;
}

Keyframe* Graph::find(KeyframeId id) { return find_state(keyframes, id); }
const Keyframe* Graph::find(KeyframeId id) const { return find_state(keyframes, id); }
PlaneLandmark* Graph::find(PlaneId id) { return find_state(planes, id); }
const PlaneLandmark* Graph::find(PlaneId id) const { return find_state(planes, id); }
SurfelLandmark* Graph::find(SurfelId id) { return find_state(surfels, id); }
const SurfelLandmark* Graph::find(SurfelId id) const { return find_state(surfels, id); }
Extrinsics* Graph::find(ExtrinsicsId id) { return find_state(extrinsics, id); }
const Extrinsics* Graph::find(ExtrinsicsId id) const { return find_state(extrinsics, id); }
CustomState* Graph::find(CustomStateId id) { return find_state(custom_states, id); }
const CustomState* Graph::find(CustomStateId id) const { return find_state(custom_states, id); }

void Graph::missing() { throw std::logic_error("graph: no state has this id"); }

std::size_t Graph::remove(KeyframeId id) {
  std::size_t gone = 0;
  const auto pair = [id](const auto& f) { return f.from == id || f.to == id; };
  const auto single = [id](const auto& f) { return f.keyframe == id; };
  gone += std::erase_if(odometry, pair) + std::erase_if(planar_odometry, pair) +
          std::erase_if(loops, pair) + std::erase_if(priors, single) +
          std::erase_if(plane_moments, single) + std::erase_if(segments, single) +
          std::erase_if(gravity, single) + std::erase_if(surfel_moments, single);
  gone += std::erase_if(marginal_priors,
                        [id](const MarginalPrior& f) { return holds(f.keyframes, id); });
  gone += erase_custom_of(custom, id);
  std::vector<SurfelId> carried;
  for (const auto& surfel : surfels) {
    if (surfel.anchor == id) carried.push_back(surfel.id);
  }
  for (const SurfelId surfel : carried) gone += remove(surfel);
  erase_state(keyframes, id);
  return gone;
}

std::size_t Graph::remove(PlaneId id) {
  const auto single = [id](const auto& f) { return f.plane == id; };
  std::size_t gone = std::erase_if(plane_moments, single) + std::erase_if(segments, single) +
                     std::erase_if(surfel_parents, single);
  gone +=
      std::erase_if(marginal_priors, [id](const MarginalPrior& f) { return holds(f.planes, id); });
  for (auto& surfel : surfels) {
    if (surfel.parent == id) surfel.parent = PlaneId::kNone;
  }
  for (auto& plane : planes) {
    if (plane.merged_into == id) plane.merged_into = PlaneId::kNone;
  }
  erase_state(planes, id);
  return gone;
}

std::size_t Graph::remove(SurfelId id) {
  const auto single = [id](const auto& f) { return f.surfel == id; };
  std::size_t gone = std::erase_if(surfel_moments, single) + std::erase_if(surfel_parents, single);
  gone +=
      std::erase_if(marginal_priors, [id](const MarginalPrior& f) { return holds(f.surfels, id); });
  erase_state(surfels, id);
  return gone;
}

void Graph::merge_planes(PlaneId from, PlaneId into) {
  PlaneLandmark& source = at(from);
  PlaneLandmark& target = at(into);
  if (from == into) return;
  const auto redirect = [&](auto& factors) {
    for (auto& factor : factors) {
      if (factor.plane == from) factor.plane = into;
    }
  };
  redirect(plane_moments);
  redirect(segments);
  redirect(surfel_parents);
  for (auto& surfel : surfels) {
    if (surfel.parent == from) surfel.parent = into;
  }
  const SE3 T_target_source = target.T_map_outline.inverse() * source.T_map_outline;
  const double cell = source.outline.cell_size();
  for (const auto& [i, j] : source.outline.cells()) {
    const Eigen::Vector3d center((i + 0.5) * cell, (j + 0.5) * cell, 0);
    target.outline.add((T_target_source * center).head<2>());
  }
  target.observations += source.observations;
  target.first_seen = std::min(target.first_seen, source.first_seen);
  target.last_seen = std::max(target.last_seen, source.last_seen);
  target.votes.floor += source.votes.floor;
  target.votes.sub_dominant += source.votes.sub_dominant;
  target.votes.obstacle += source.votes.obstacle;
  target.covariance.reset();
  source.active = false;
  source.merged_into = into;
}

std::size_t Graph::factor_count() const {
  return odometry.size() + planar_odometry.size() + loops.size() + priors.size() +
         plane_moments.size() + segments.size() + gravity.size() + surfel_moments.size() +
         surfel_parents.size() + marginal_priors.size() + custom.size();
}

}  // namespace lamina
