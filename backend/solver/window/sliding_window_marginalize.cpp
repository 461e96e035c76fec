// What leaves the window, and the prior it leaves behind.
#include <lamina/backend/solver/window/sliding_window.hpp>
#include <lamina/backend/solver/window/window_equations.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>

namespace lamina {

namespace {

// Jacobians are taken at one point as soon as a marginal prior holds the state; the present one.
template <class State>
auto freeze(State& state) {
  if (!state.frozen) state.first = state.now;
  state.frozen = true;
  return state.now;
}

void carry_cell(const SE3& T, Eigen::Matrix3d& R_map_cell, Eigen::Vector3d& t_map_cell) {
  R_map_cell = (T.so3().matrix() * R_map_cell).eval();
  t_map_cell = T * t_map_cell;
}

}  // namespace

// Elimination order -> linearise -> QR -> prior.
void SlidingWindow::eliminate(const std::vector<bool>& pose_gone,
                              const std::vector<bool>& plane_gone, bool remember) {
  std::vector<int> sizes(state_.poses.size(), 6), gone;
  sizes.insert(sizes.end(), state_.planes.size(), 3);
  const auto goes = [&](std::size_t i) {
    return i < state_.poses.size() ? pose_gone[i] : plane_gone[i - state_.poses.size()];
  };
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (goes(i)) gone.push_back(static_cast<int>(i));
  }
  if (gone.empty()) return;
  const std::vector<LinearFactor> factors =
      linearize_touching(state_, options_.robust_chi_squared, pose_gone, plane_gone);
  const EliminationOrder order = elimination_order(sizes, gone, factors);
  const SquareRootInformation left = eliminate_by_qr(linear_system(order, factors));
  leave_behind(order, left, plane_gone, remember);

  window::Prior prior;
  for (const int v : order.variables) {
    const auto i = static_cast<std::size_t>(v);
    if (goes(i)) continue;
    if (i < state_.poses.size()) {
      prior.poses.push_back(state_.poses[i].id);
      prior.poses_at.push_back(freeze(state_.poses[i]).se3());
    } else {
      prior.planes.push_back(state_.planes[i - state_.poses.size()].id);
      prior.planes_at.push_back(freeze(state_.planes[i - state_.poses.size()]));
    }
  }
  if (left.R.rows() > 0) {
    prior.R = left.R;
    prior.r = left.r;
    prior.H = gram(left.R);
  } else {
    prior = window::Prior();
  }

  prior.serial = state_.next_serial();
  state_.prior = std::move(prior);
  state_.erase(pose_gone, plane_gone);
  solved_ = false;
}

std::vector<bool> SlidingWindow::planes_to_leave(int poses_gone) const {
  std::vector<bool> leave(state_.planes.size(), false), seen(state_.planes.size(), false);
  for (const auto& s : state_.views) {
    if (find(s.keyframe) >= poses_gone) seen[static_cast<std::size_t>(find(s.plane))] = true;
  }
  std::vector<std::size_t> idle;
  std::size_t staying = state_.planes.size();
  for (std::size_t i = 0; i < state_.planes.size(); ++i) {
    if (seen[i]) continue;
    const std::int64_t lag = options_.keyframes + options_.idle_keyframes;
    if (keyframes_added_ - state_.planes[i].idle_since >= lag) {
      leave[i] = true;
      --staying;
    } else {
      idle.push_back(i);
    }
  }
  std::stable_sort(idle.begin(), idle.end(), [&](std::size_t a, std::size_t b) {
    return state_.planes[a].idle_since < state_.planes[b].idle_since;
  });
  for (const std::size_t i : idle) {
    if (staying <= static_cast<std::size_t>(options_.max_planes)) break;
    leave[i] = true;
    --staying;
  }
  return leave;
}

WindowDepartures SlidingWindow::marginalize() {
  WindowDepartures departures;
  std::size_t gone = 0;
  const auto too_old = [&](std::size_t i) {
    const std::size_t rest = state_.poses.size() - i;
    if (rest <= 3) return false;
    if (rest > static_cast<std::size_t>(options_.keyframes)) return true;
    return options_.seconds > 0 &&
           state_.poses.back().stamp - state_.poses[i].stamp > options_.seconds;
  };
  while (gone < state_.poses.size() && too_old(gone)) ++gone;
  if (gone == 0) return departures;
  std::vector<bool> pose_gone(state_.poses.size(), false);
  for (std::size_t i = 0; i < gone; ++i) {
    pose_gone[i] = true;
    departures.poses.push_back({state_.poses[i].id, state_.poses[i].now.se3()});
  }
  const std::vector<bool> plane_gone = planes_to_leave(static_cast<int>(gone));
  for (std::size_t i = 0; i < state_.planes.size(); ++i) {
    if (!plane_gone[i]) continue;
    departures.planes.push_back({state_.planes[i].id, plane_anchor(state_.planes[i].id),
                                 solved_ ? plane_covariance(static_cast<int>(i))
                                         : Eigen::Matrix3d::Constant(std::nan(""))});
  }
  eliminate(pose_gone, plane_gone, true);
  return departures;
}

void SlidingWindow::move(const SE3& T) {
  const Eigen::Matrix3d R = T.so3().matrix();
  const auto turn = [&R](PlaneState& plane) { plane = plane.turned(R); };
  for (auto& pose : state_.poses) {
    pose.now = PoseState(T * pose.now.se3());
    pose.first = PoseState(T * pose.first.se3());
  }
  for (auto* planes : {&state_.planes, &behind_}) {
    for (auto& plane : *planes) {
      plane.anchor = T * plane.anchor;
      turn(plane.now);
      turn(plane.first);
    }
  }
  for (auto& single : state_.pose_priors) {
    single.term.T_body_map_measured = single.term.T_body_map_measured * T.inverse();
  }
  for (auto& hold : state_.plane_priors) turn(hold.at);
  for (auto& pose : state_.prior.poses_at) pose = T * pose;
  for (auto& plane : state_.prior.planes_at) turn(plane);
  for (auto& view : state_.views) view.term.anchor_map = T * view.term.anchor_map;
  for (auto& surfel : state_.surfels) {
    surfel.tie.anchor_map = T * surfel.tie.anchor_map;
    carry_cell(T, surfel.tie.R_body_cell, surfel.tie.t_body_cell);
    for (auto& view : surfel.views) carry_cell(T, view.term.R_body_cell, view.term.t_body_cell);
  }
  state_.renew_serials();
}

bool SlidingWindow::merge_planes(PlaneId from, PlaneId into) {
  const int a = find(from), b = find(into);
  if (a < 0 || b < 0 || a == b) return false;
  // What the prior has of `from` goes with it: only direct views change hands.
  for (auto& view : state_.views) {
    if (view.plane != from) continue;
    view.plane = into;
    view.term.anchor_map = state_.planes[static_cast<std::size_t>(b)].anchor;
    view.serial = state_.next_serial();
  }
  for (auto& surfel : state_.surfels) {
    if (surfel.parent != from) continue;
    surfel.parent = into;
    surfel.tie.anchor_map = state_.planes[static_cast<std::size_t>(b)].anchor;
    surfel.serial = state_.next_serial();
  }
  auto& kept = state_.planes[static_cast<std::size_t>(b)];
  const auto& gone = state_.planes[static_cast<std::size_t>(a)];
  kept.idle_since = std::max(kept.idle_since, gone.idle_since);
  std::vector<bool> plane_gone(state_.planes.size(), false);
  plane_gone[static_cast<std::size_t>(a)] = true;
  eliminate(std::vector<bool>(state_.poses.size(), false), plane_gone, false);
  return true;
}

bool SlidingWindow::set_anchor(PlaneId id, const Eigen::Vector3d& anchor_map) {
  const int at = find(id);
  if (at < 0 || !anchor_map.allFinite()) return false;
  window::Landmark& plane = state_.planes[static_cast<std::size_t>(at)];
  const Eigen::Vector3d shift = anchor_map - plane.anchor;
  // rho_new = rho - n.shift, so a step (tilt, rho_new) is (tilt, rho_new + shift^T B tilt) here.
  const auto old_from_new = [&shift](const PlaneState& held) {
    Eigen::Matrix3d M = Eigen::Matrix3d::Identity();
    M.bottomLeftCorner<1, 2>() = shift.transpose() * held.B;
    return M;
  };
  const auto shift_rho = [&shift](PlaneState& held) { held.rho -= held.n.dot(shift); };
  for (auto& hold : state_.plane_priors) {
    if (hold.id != id) continue;
    hold.S = (hold.S * old_from_new(hold.at)).eval();
    shift_rho(hold.at);
  }
  for (std::size_t i = 0; i < state_.prior.planes.size(); ++i) {
    if (state_.prior.planes[i] != id) continue;
    const auto column = static_cast<Eigen::Index>(6 * state_.prior.poses.size() + 3 * i);
    state_.prior.R.middleCols<3>(column) =
        (state_.prior.R.middleCols<3>(column) * old_from_new(state_.prior.planes_at[i])).eval();
    state_.prior.H = gram(state_.prior.R);
    states_behind_.change_columns(column, old_from_new(state_.prior.planes_at[i]));
    shift_rho(state_.prior.planes_at[i]);
  }
  shift_rho(plane.now);
  shift_rho(plane.first);
  plane.anchor = anchor_map;
  for (auto& view : state_.views) {
    if (view.plane == id) view.term.anchor_map = anchor_map;
  }
  for (auto& surfel : state_.surfels) {
    if (surfel.parent == id) surfel.tie.anchor_map = anchor_map;
  }
  state_.renew_serials();
  solved_ = false;
  return true;
}

// ------------------------------------------------------------------------------- estimates

SE3 SlidingWindow::pose(KeyframeId id) const {
  const int i = find(id);
  LAMINA_CHECK(i >= 0);
  return state_.poses[static_cast<std::size_t>(i)].now.se3();
}

Plane SlidingWindow::plane_anchor(PlaneId id) const {
  const int i = find(id);
  LAMINA_CHECK(i >= 0);
  return state_.planes[static_cast<std::size_t>(i)].now.plane();
}

std::vector<KeyframeId> SlidingWindow::keyframes() const {
  std::vector<KeyframeId> result;
  for (const auto& pose : state_.poses) result.push_back(pose.id);
  return result;
}

std::vector<PlaneId> SlidingWindow::planes() const {
  std::vector<PlaneId> result;
  for (const auto& plane : state_.planes) result.push_back(plane.id);
  return result;
}

}  // namespace lamina
