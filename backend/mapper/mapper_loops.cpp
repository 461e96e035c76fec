// Places met again, motions told from outside, refinement, and keyframes that are not needed.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include <lamina/backend/association/outline_split.hpp>
#include <lamina/backend/graph/loop_agreement.hpp>
#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/backend/mapper/mapper_step.hpp>
#include <lamina/backend/mapper/relative_pose_from_planes.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;

RecognitionPlane recognition_plane(const PlaneLandmark& plane, const Eigen::Matrix3d& covariance) {
  RecognitionPlane result;
  result.id = plane.id;
  result.plane_map = plane.plane_map();
  result.middle_map = outline_centroid_map(plane);
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J.bottomLeftCorner<1, 2>() =
      -(result.middle_map - plane.anchor_map).transpose() * plane.plane_anchor.tangent_basis();
  result.covariance = J * covariance * J.transpose();
  // Drift that all planes share is the motion that is looked for; what is left is local.
  const double limit = 0.1 * 0.1;
  result.covariance *= std::min(1.0, limit / std::max(1e-12, result.covariance(2, 2)));
  return result;
}

// The part of a motion about a point that upright walls tell: in plan.
SE3 in_plan(const SE3& T, const Eigen::Vector3d& about) {
  const SO3 turn = SO3::rot_z(T.so3().yaw());
  Eigen::Vector3d to = T * about;
  to.z() = about.z();
  return {turn, to - turn * about};
}

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
  return OdometryFactor{in->from, out->to, in->T_from_to * out->T_from_to, S};
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

}  // namespace

bool Mapper::recognise() {
  std::vector<RecognitionPlane> fresh, old;
  for (const auto& [id, views] : gathered_) {
    const auto joint = joint_.find(id);
    const PlaneLandmark& plane = graph_.at(id);
    if (joint == joint_.end() || !plane.active) continue;
    fresh.push_back(recognition_plane(plane, joint->second.bottomRightCorner<3, 3>()));
  }
  if (fresh.size() < static_cast<std::size_t>(options_.place.min_planes)) return false;
  for (const auto& plane : graph_.planes) {
    if (!plane.active || window_.contains(plane.id) || !plane.covariance) continue;
    old.push_back(recognition_plane(plane, *plane.covariance));
  }
  const Eigen::Vector3d body = graph_.at(keyframe_).T_map_body.translation();
  const double sigma = std::sqrt(keyframe_covariance_.topLeftCorner<3, 3>().trace());
  const auto match = recognise_place(fresh, old, index_, body, 0.5 + 3 * sigma, options_.place);
  if (!match) return false;
  // Level scans see walls as lines; how those lean, and so height and tilt, is the prior's word.
  const bool upright_lines =
      std::all_of(match->pairs.begin(), match->pairs.end(), [this](const auto& pair) {
        constexpr double kUpright = 0.3;
        return partial_.count(pair.first) > 0 &&
               std::abs(graph_.at(pair.first).plane_anchor.normal().z()) < kUpright;
      });
  close_loop(upright_lines ? in_plan(match->T_old_new, body) : match->T_old_new, match->pairs);
  return true;
}

// The window goes on in the old part of the map; the refiner spreads the difference over the path.
void Mapper::close_loop(const SE3& T_old_new,
                        const std::vector<std::pair<PlaneId, PlaneId>>& pairs) {
  window_.move(T_old_new);
  for (const auto& [fresh, old] : pairs) {
    if (!graph_.at(fresh).active || !graph_.at(old).active) continue;
    if (window_.contains(old)) {
      window_.merge_planes(fresh, old);  // two new planes are one old plane
    } else {
      window_.rename_plane(fresh, old);
    }
    absorb(fresh, old);
  }
  for (const KeyframeId id : window_.keyframes()) graph_.at(id).T_map_body = window_.pose(id);
  for (const PlaneId id : window_.planes()) {
    PlaneLandmark& plane = graph_.at(id);
    window_.set_anchor(id, plane.anchor_map);
    plane.set_plane_anchor(window_.plane_anchor(id));
    // Seen in the window only: its outline moves along. Others are made anew by refine().
    std::vector<Eigen::Vector3d> points;
    for (const auto& piece : outlines_[id]) {
      const Keyframe* keyframe = graph_.find(piece.keyframe);
      if (!keyframe) continue;
      for (const auto& p : piece.points_body) points.push_back(keyframe->T_map_body * p);
    }
    remake_outline(plane, outlines_[id], graph_, options_.outline_cell_m);
    index_.insert(id, points);
  }
  for (auto& tentative : tentatives_) refit(tentative);
  joint_.clear();
}

bool Mapper::add_loop(KeyframeId from, KeyframeId to, const SE3& T_from_to,
                      const Matrix6d& covariance) {
  if (from == to || !graph_.find(from) || !graph_.find(to)) return false;
  const Eigen::LLT<Matrix6d> llt(covariance);
  if (!covariance.allFinite() || llt.info() != Eigen::Success) return false;
  if (!T_from_to.translation().allFinite()) return false;
  const Matrix6d S = llt.matrixL().solve(Matrix6d::Identity());
  const LoopFactor factor{from, to, T_from_to, S, 1.0};
  graph_.loops.push_back(factor);
  window_.add(factor);  // where both ends are in it
  return true;
}

// Every outline, and the index of planes by place, from what the keyframes saw, where they are now.
void Mapper::remake_outlines() {
  index_.clear();
  for (auto& plane : graph_.planes) {
    if (!plane.active) continue;
    remake_outline(plane, outlines_[plane.id], graph_, options_.outline_cell_m);
    for (const auto& piece : outlines_[plane.id]) {
      const Keyframe* keyframe = graph_.find(piece.keyframe);
      if (!keyframe) continue;
      std::vector<Eigen::Vector3d> points;
      for (const auto& p : piece.points_body) points.push_back(keyframe->T_map_body * p);
      index_.insert_outline(plane.id, points);
    }
  }
}

void Mapper::share_outlines(PlaneId old, PlaneId made) {
  share_pieces(graph_, old, made, outlines_[old], outlines_[made]);
}

namespace {

// Once more, and what it took in all.
RefineResult refine_again(Graph& graph, const RefineResult& before, const RefineOptions& options,
                          const std::function<bool(const RefineProgress&)>& progress) {
  RefineResult next = lamina::refine(graph, options, progress);
  next.iterations += before.iterations;
  next.rounds += before.rounds;
  next.solve_s += before.solve_s;
  return next;
}

}  // namespace

// Planes that are two are parted, planes that are one merged, and the graph solved again: what
// ties places together tells more doubles. Merges that the solution contradicts are taken back.
RefineResult Mapper::settle_planes(RefineResult result, const RefineOptions& options,
                                   const std::function<bool(const RefineProgress&)>& progress) {
  const int most_rounds = options.thorough ? 4 : 2;
  constexpr int kMostShifts = 3;
  PlanePairs apart;
  std::vector<std::pair<PlaneId, PlaneId>> merged;
  bool reconsidered = false;
  int shifts = 0;
  for (int round = 0; round < most_rounds + shifts; ++round) {
    std::size_t changes = undo_contradicted(merged, apart) + stand_up_fallen();
    if (round == 0) {
      changes += part_rejected(result.rejected, apart);
      remake_outlines();
      if (options_.merge_planes) changes += merge_lines();
    }
    merged.clear();
    if (options_.merge_planes && round + 1 < most_rounds + shifts) merged = merge_refined(apart);
    changes += merged.size();
    if (changes == 0 && options.thorough && options_.merge_planes && shifts < kMostShifts &&
        test_shifts(result, options, progress) > 0) {
      ++changes;
      ++shifts;
    }
    if (changes == 0 && options.thorough && options_.merge_planes && !reconsidered) {
      reconsidered = true;
      changes += test_merges(result, options, apart, progress);
    }
    if (changes == 0) break;
    remake_outlines();
    RefineOptions again = options;
    again.refined_before = round > 0;
    again.thorough = false;  // loops that were left out have had their second hearing
    result = refine_again(graph_, result, again, progress);
    if (result.status == SolveStatus::kCancelled) break;
  }
  remake_outlines();
  return result;
}

RefineResult Mapper::refine(const RefineOptions& options,
                            const std::function<bool(const RefineProgress&)>& progress) {
  const SE3 before = keyframe_ == KeyframeId::kNone ? SE3() : graph_.at(keyframe_).T_map_body;
  RefineResult result = lamina::refine(graph_, options, progress);
  if (result.status != SolveStatus::kCancelled && result.status != SolveStatus::kInvalidInput) {
    result = settle_planes(std::move(result), options, progress);
    std::erase_if(merges_, [](const auto& merge) { return merge.second.stood; });
    for (auto& [id, record] : merges_) record.stood = true;
  }
  drop_unsupported();
  refined_ = keyframe_;
  if (keyframe_ == KeyframeId::kNone) return result;
  // The window follows as one body: its prior says nothing about where it is, only how it hangs
  // together.
  window_.move(graph_.at(keyframe_).T_map_body * before.inverse());
  for (const PlaneId id : window_.planes()) window_.set_anchor(id, graph_.at(id).anchor_map);
  for (auto& tentative : tentatives_) refit(tentative);
  return result;
}

void Mapper::move(const SE3& T_new_map) {
  for (auto& [id, joint] : joint_) {
    // Pose errors are the body's own: they stay. Those of the plane turn with its tangent.
    Eigen::Matrix<double, 9, 9> M = Eigen::Matrix<double, 9, 9>::Identity();
    M.bottomRightCorner<3, 3>() =
        Plane::tangent_turn(T_new_map.so3(), graph_.at(id).plane_anchor.normal());
    joint = (M * joint * M.transpose()).eval();
  }
  graph_.move(T_new_map);
  for (auto& [id, T_map_body] : left_window_) T_map_body = T_new_map * T_map_body;
  for (auto& [id, record] : merges_) {
    Graph one;
    one.planes.push_back(record.landmark);
    one.marginal_priors = record.priors;
    one.move(T_new_map);
    record.landmark = one.planes.front();
    record.priors = one.marginal_priors;
  }
  if (first_floor_map_) first_floor_map_ = T_new_map * *first_floor_map_;
  window_.move(T_new_map);
  remake_outlines();
  for (auto& tentative : tentatives_) refit(tentative);
}

// The nearest older keyframe from about the same place.
const Keyframe* Mapper::nearest_older(const Keyframe& keyframe) const {
  const Keyframe* found = nullptr;
  double nearest = options_.reuse_distance_m;
  for (const Keyframe& other : graph_.keyframes) {
    if (other.id >= keyframe.id) break;
    if (window_.contains(other.id)) continue;
    const SE3 between = other.T_map_body.inverse() * keyframe.T_map_body;
    const double off = between.translation().norm();
    if (off >= nearest || between.so3().log().norm() > options_.reuse_angle_deg * kDegree) continue;
    nearest = off;
    found = &other;
  }
  return found;
}

// It saw all planes that the keyframe saw but those that plenty of others saw, and half of them at
// least: what the map knows stays.
bool Mapper::stands_in(const Keyframe& other, const Keyframe& keyframe) const {
  constexpr int kPlenty = 6;
  std::set<PlaneId> there;
  std::map<PlaneId, int> here;  // and by how many others
  for (const auto& f : graph_.plane_moments) {
    if (f.keyframe == keyframe.id) here[f.plane] = 0;
    if (f.keyframe == other.id) there.insert(f.plane);
  }
  for (const auto& f : graph_.plane_moments) {
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

// A keyframe beyond the window that an older one can stand in for goes: its planes are seen from
// there, its frames and floor hang on the older one, odometry is chained past it.
bool Mapper::retire(KeyframeId id) {
  const Keyframe* keyframe = graph_.find(id);
  if (!keyframe || keyframe->fixed || options_.reuse_distance_m <= 0) return false;
  if (!loops_can_go(graph_, *keyframe, options_.reuse_angle_deg * kDegree)) return false;
  const Keyframe* stand_in = nearest_older(*keyframe);
  if (!stand_in) return false;
  if (!stands_in(*stand_in, *keyframe)) {
    ++waiting_;  // its planes may be those of the other, met again: the refiner will say
    return false;
  }
  const auto chain = chained_past(graph_, id);
  if (!chain) return false;
  // What hangs on the stand-in follows it for good: it must hang where both saw their planes, not
  // where poses lie that a lap's drift, not yet spread over the path, keeps apart. Along a corridor
  // nothing but the poses tells: it stays until they have been refined.
  const KeyframeId into = stand_in->id;
  const SE3 guess = stand_in->T_map_body.inverse() * keyframe->T_map_body;
  const SharedPose shared = pose_by_shared_planes(graph_, into, id, guess);
  const bool laid_out = id <= refined_;
  if (!laid_out && !tells_place(shared)) {
    ++waiting_;
    return false;
  }
  const SE3 T_stand_gone = shared.T_a_b;
  frames_.transfer(id, into, T_stand_gone);
  left_window_.erase(id);  // its frames take the stand-in's
  surfels_.transfer(id, into, T_stand_gone);
  successors_.insert(into);
  loose_body_.erase(id);
  for (auto& [plane, pieces] : outlines_) {
    std::erase_if(pieces, [id](const OutlinePiece& p) { return p.keyframe == id; });
  }
  graph_.remove(id);
  graph_.odometry.push_back(*chain);
  return true;
}

void Mapper::retire_again() {
  waiting_ = 0;
  for (const KeyframeId id : std::exchange(stayed_, {})) retire(id);
}

}  // namespace lamina
