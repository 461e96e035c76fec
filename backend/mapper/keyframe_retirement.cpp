// Who stands in for whom.
#include <lamina/backend/mapper/keyframe_retirement.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <utility>

#include <lamina/backend/graph/loop_agreement.hpp>
#include <lamina/backend/mapper/relative_pose_from_planes.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;

// Odometry from the keyframe before to the one after; nullopt at the ends of the path.
std::optional<OdometryFactor> chained_past(const Graph& graph, KeyframeId id) {
  const OdometryFactor *in = nullptr, *out = nullptr;
  for (const auto& f : graph.odometry) {
    if (f.to == id) in = &f;
    if (f.from == id) out = &f;
  }
  if (!in || !out) return std::nullopt;
  const auto covariance = [](const Matrix6d& S) {
    return Matrix6d((S.transpose() * S).ldlt().solve(Matrix6d::Identity()));
  };
  const Matrix6d A = out->T_from_to.inverse().adjoint();
  const Matrix6d C =
      A * covariance(in->sqrt_information) * A.transpose() + covariance(out->sqrt_information);
  const Eigen::LLT<Matrix6d> llt(C);
  if (llt.info() != Eigen::Success) return std::nullopt;
  const Matrix6d S = llt.matrixL().solve(Matrix6d::Identity());
  // Of a sensor's motion and one that others measured the sum is mostly the sensor's.
  const ExtrinsicsId sensor =
      in->extrinsics == ExtrinsicsId::kNone ? out->extrinsics : in->extrinsics;
  return OdometryFactor{in->from, out->to, in->T_from_to * out->T_from_to, S, sensor};
}

// Each cell of the map on one keyframe. Cells of ground that swells tie the keyframes that saw them
// in the joint estimate: those are on up to three, of every third keyframe by itself.
void condense(WorkingMap& map, const std::vector<KeyframeId>& ids, double radius_m) {
  const bool ties = map.options.joint_surfels.enabled && map.ground.swells();
  const std::int64_t holders = ties ? 3 : 1;
  for (std::int64_t k = 0; k < holders; ++k) {
    std::vector<KeyframeId> some = ids;
    std::erase_if(some,
                  [&](KeyframeId id) { return static_cast<std::int64_t>(id) % holders != k; });
    map.surfels.condense(map.graph, some, radius_m);
  }
}

bool has_custom_factor(const Graph& graph, KeyframeId id) {
  return std::any_of(graph.custom.begin(), graph.custom.end(), [id](const CustomFactor& f) {
    return std::find(f.states.begin(), f.states.end(), StateRef(id)) != f.states.end();
  });
}

// The keyframe's loops tell nothing new: each agrees with the poses there are, and its place is
// held by loops of enough others: a loop is told by a few metres of the way, so those begun within
// half of that hold the same place.
bool loops_can_go(const Graph& graph, const Keyframe& keyframe, double angle) {
  constexpr std::size_t kEnough = 3;
  constexpr double kSamePlace = 1.5;  // m
  bool own = false;
  for (const LoopFactor& loop : graph.loops) {
    if (loop.from != keyframe.id && loop.to != keyframe.id) continue;
    if (!agrees(graph, loop)) return false;
    own = true;
  }
  if (!own) return true;
  std::set<KeyframeId> held;  // by loops
  for (const LoopFactor& loop : graph.loops) held.insert({loop.from, loop.to});
  std::size_t near = 0;
  for (const KeyframeId id : held) {
    if (id == keyframe.id) continue;
    const SE3 between = graph.at(id).T_map_body.inverse() * keyframe.T_map_body;
    near += between.translation().norm() < kSamePlace && between.so3().log().norm() < angle;
  }
  return near >= kEnough;
}

// The nearest older keyframe from about the same place.
const Keyframe* nearest_older(const WorkingMap& map, const Keyframe& keyframe) {
  const Keyframe* found = nullptr;
  double nearest = map.options.reuse_distance_m;
  for (const Keyframe& other : map.graph.keyframes) {
    if (other.id >= keyframe.id) break;
    if (map.window.contains(other.id)) continue;
    const SE3 between = other.T_map_body.inverse() * keyframe.T_map_body;
    const double off = between.translation().norm();
    if (off >= nearest || between.so3().log().norm() > map.options.reuse_angle_deg * kDegree)
      continue;
    nearest = off;
    found = &other;
  }
  return found;
}

// It saw all planes that the keyframe saw but those that plenty of others saw, and half of them at
// least: what the map knows stays.
bool stands_in(const Graph& graph, const Keyframe& other, const Keyframe& keyframe) {
  constexpr int kPlenty = 6;
  std::set<PlaneId> there;
  std::map<PlaneId, int> here;  // and by how many others
  for (const auto& f : graph.plane_moments) {
    if (f.keyframe == keyframe.id) here[f.plane] = 0;
    if (f.keyframe == other.id) there.insert(f.plane);
  }
  for (const auto& f : graph.plane_moments) {
    const auto it = f.keyframe == keyframe.id ? here.end() : here.find(f.plane);
    if (it != here.end()) ++it->second;
  }
  std::size_t shared = 0;
  for (const auto& [plane, others] : here) {
    if (there.count(plane)) {
      ++shared;
    } else if (others < kPlenty) {
      return false;
    }
  }
  return 2 * shared >= here.size();
}

}  // namespace

bool KeyframeRetirement::retire(WorkingMap& map, KeyframeId id) {
  const MapperOptions& options = map.options;
  const Keyframe* keyframe = map.graph.find(id);
  if (!keyframe || keyframe->fixed || options.reuse_distance_m <= 0) return false;
  if (has_custom_factor(map.graph, id)) return false;
  if (!loops_can_go(map.graph, *keyframe, options.reuse_angle_deg * kDegree)) return false;
  const Keyframe* stand_in = nearest_older(map, *keyframe);
  if (!stand_in) return false;
  if (!stands_in(map.graph, *stand_in, *keyframe)) {
    ++waiting_;  // its planes may be those of the other, met again: the refiner will say
    return false;
  }
  const auto chain = chained_past(map.graph, id);
  if (!chain) return false;
  // What hangs on the stand-in follows it for good: it must hang where both saw their planes, not
  // where poses lie that a lap's drift, not yet spread over the path, keeps apart. Along a corridor
  // nothing but the poses tells: it stays until they have been refined.
  const KeyframeId into = stand_in->id;
  const SE3 guess = stand_in->T_map_body.inverse() * keyframe->T_map_body;
  const SharedPose shared = pose_by_shared_planes(map.graph, into, id, guess);
  const bool laid_out = id <= refined_;
  if (!laid_out && !tells_place(shared)) {
    ++waiting_;
    return false;
  }
  map.replace_keyframe(id, into, shared.T_a_b);
  map.graph.odometry.push_back(*chain);
  successors_.insert(into);
  return true;
}

void KeyframeRetirement::departed(WorkingMap& map, KeyframeId id) {
  if (!retire(map, id)) stayed_.push_back(id);
}

void KeyframeRetirement::retire_again(WorkingMap& map) {
  waiting_ = 0;
  for (const KeyframeId id : std::exchange(stayed_, {})) retire(map, id);
}

// Keyframes with floor that lie where the last refinement put them: what came after it does not lie
// where the next one will.
std::vector<KeyframeId> KeyframeRetirement::laid_out_floor(const WorkingMap& map) const {
  std::vector<KeyframeId> result = map.surfels.keyframes();
  std::erase_if(result, [&](KeyframeId id) { return id > refined_ || map.window.contains(id); });
  return result;
}

void KeyframeRetirement::condense_floor(WorkingMap& map, double radius_m) {
  condense(map, laid_out_floor(map), radius_m);
  successors_.clear();
}

void KeyframeRetirement::condense_newest_floor(WorkingMap& map, double radius_m) {
  condense_successors(map, radius_m);
  // Those before them see the same floor: as many as reach as far as the camera does.
  constexpr std::int64_t kSeam = 25;  // some 10 m
  const auto last = static_cast<std::int64_t>(condensed_);
  const KeyframeId known =
      std::max(refined_, static_cast<KeyframeId>(std::max<std::int64_t>(-1, last - kSeam)));
  std::vector<KeyframeId> newest = map.surfels.keyframes();
  std::erase_if(newest, [&](KeyframeId id) { return id <= known || map.window.contains(id); });
  if (newest.empty() || newest.back() <= condensed_) return;
  condense(map, newest, radius_m);
  condensed_ = newest.back();
}

// What successors hold, with that of others which see the same floor.
void KeyframeRetirement::condense_successors(WorkingMap& map, double radius_m) {
  double reach = 0;
  std::vector<Eigen::Vector3d> places;
  for (const KeyframeId id : std::exchange(successors_, {})) {
    const Keyframe* keyframe = map.graph.find(id);
    if (keyframe == nullptr || id > refined_) continue;
    places.push_back(keyframe->T_map_body.translation());
    reach = std::max(reach, map.surfels.reach(id));
  }
  if (places.empty()) return;
  std::vector<KeyframeId> about = laid_out_floor(map);
  std::erase_if(about, [&](KeyframeId id) {
    const Keyframe* keyframe = map.graph.find(id);
    return keyframe == nullptr || std::none_of(places.begin(), places.end(), [&](const auto& p) {
             return (keyframe->T_map_body.translation() - p).norm() < 2 * reach;
           });
  });
  condense(map, about, radius_m);
}

}  // namespace lamina
