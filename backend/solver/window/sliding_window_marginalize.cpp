// What leaves the window, and the prior it leaves behind.
#include <lamina/backend/solver/window/sliding_window.hpp>

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

template <class State>
void erase_marked(std::vector<State>& states, const std::vector<bool>& gone) {
  std::erase_if(states, [&](const State& state) {
    return gone[static_cast<std::size_t>(&state - states.data())];
  });
}

}  // namespace

// Elimination order -> linearise -> QR -> prior.
void SlidingWindow::eliminate(const std::vector<bool>& pose_gone,
                              const std::vector<bool>& plane_gone, bool remember) {
  std::vector<int> sizes(poses_.size(), 6), gone;
  sizes.insert(sizes.end(), planes_.size(), 3);
  const auto goes = [&](std::size_t i) {
    return i < poses_.size() ? pose_gone[i] : plane_gone[i - poses_.size()];
  };
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (goes(i)) gone.push_back(static_cast<int>(i));
  }
  if (gone.empty()) return;
  const std::vector<LinearFactor> factors = linearize_touching(pose_gone, plane_gone);
  const EliminationOrder order = elimination_order(sizes, gone, factors);
  const SquareRootInformation left = eliminate_by_qr(linear_system(order, factors));
  leave_behind(order, left, plane_gone, remember);

  Prior prior;
  for (const int v : order.variables) {
    const auto i = static_cast<std::size_t>(v);
    if (goes(i)) continue;
    if (i < poses_.size()) {
      prior.poses.push_back(poses_[i].id);
      prior.poses_at.push_back(freeze(poses_[i]));
    } else {
      prior.planes.push_back(planes_[i - poses_.size()].id);
      prior.planes_at.push_back(freeze(planes_[i - poses_.size()]));
    }
  }
  if (left.R.rows() > 0) {
    prior.R = left.R;
    prior.r = left.r;
    prior.H = gram(left.R);
  } else {
    prior = Prior();
  }

  const auto pose_is_gone = [&](KeyframeId id) {
    return pose_gone[static_cast<std::size_t>(find(id))];
  };
  const auto plane_is_gone = [&](PlaneId id) {
    return plane_gone[static_cast<std::size_t>(find(id))];
  };
  std::erase_if(betweens_,
                [&](const Between& f) { return pose_is_gone(f.from) || pose_is_gone(f.to); });
  std::erase_if(singles_, [&](const Single& f) { return pose_is_gone(f.id); });
  std::erase_if(gravity_, [&](const Gravity& f) { return pose_is_gone(f.id); });
  std::erase_if(holds_, [&](const PlaneHold& f) { return plane_is_gone(f.id); });
  std::erase_if(sightings_, [&](const Sighting& f) {
    return pose_is_gone(f.keyframe) || plane_is_gone(f.plane);
  });
  prior_ = std::move(prior);
  erase_marked(poses_, pose_gone);
  erase_marked(planes_, plane_gone);
  solved_ = false;
}

std::vector<bool> SlidingWindow::planes_to_leave(int poses_gone) const {
  std::vector<bool> leave(planes_.size(), false), seen(planes_.size(), false);
  for (const auto& s : sightings_) {
    if (find(s.keyframe) >= poses_gone) seen[static_cast<std::size_t>(find(s.plane))] = true;
  }
  std::vector<std::size_t> idle;
  std::size_t staying = planes_.size();
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    if (seen[i]) continue;
    const std::int64_t lag = options_.keyframes + options_.idle_keyframes;
    if (keyframes_added_ - planes_[i].idle_since >= lag) {
      leave[i] = true;
      --staying;
    } else {
      idle.push_back(i);
    }
  }
  std::stable_sort(idle.begin(), idle.end(), [&](std::size_t a, std::size_t b) {
    return planes_[a].idle_since < planes_[b].idle_since;
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
    const std::size_t rest = poses_.size() - i;
    if (rest <= 3) return false;
    if (rest > static_cast<std::size_t>(options_.keyframes)) return true;
    return options_.seconds > 0 && poses_.back().stamp - poses_[i].stamp > options_.seconds;
  };
  while (gone < poses_.size() && too_old(gone)) ++gone;
  if (gone == 0) return departures;
  std::vector<bool> pose_gone(poses_.size(), false);
  for (std::size_t i = 0; i < gone; ++i) {
    pose_gone[i] = true;
    departures.poses.push_back({poses_[i].id, poses_[i].now});
  }
  const std::vector<bool> plane_gone = planes_to_leave(static_cast<int>(gone));
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    if (!plane_gone[i]) continue;
    departures.planes.push_back({planes_[i].id, plane_anchor(planes_[i].id),
                                 solved_ ? plane_covariance(static_cast<int>(i))
                                         : Eigen::Matrix3d::Constant(std::nan(""))});
  }
  eliminate(pose_gone, plane_gone, true);
  return departures;
}

void SlidingWindow::move(const SE3& T) {
  const Eigen::Matrix3d R = T.so3().matrix();
  const auto turn = [&R](Chart& chart) {
    chart.normal = R * chart.normal;
    chart.basis = R * chart.basis;
  };
  for (auto& pose : poses_) {
    pose.now = T * pose.now;
    pose.first = T * pose.first;
  }
  for (auto* planes : {&planes_, &behind_}) {
    for (auto& plane : *planes) {
      plane.anchor = T * plane.anchor;
      turn(plane.now);
      turn(plane.first);
    }
  }
  for (auto& single : singles_) single.T = T * single.T;
  for (auto& hold : holds_) turn(hold.at);
  for (auto& pose : prior_.poses_at) pose = T * pose;
  for (auto& plane : prior_.planes_at) turn(plane);
}

bool SlidingWindow::merge_planes(PlaneId from, PlaneId into) {
  const int a = find(from), b = find(into);
  if (a < 0 || b < 0 || a == b) return false;
  // What the prior knows of `from` goes with it: only direct sightings change hands.
  for (auto& s : sightings_) {
    if (s.plane == from) s.plane = into;
  }
  auto& kept = planes_[static_cast<std::size_t>(b)];
  const auto& gone = planes_[static_cast<std::size_t>(a)];
  kept.idle_since = std::max(kept.idle_since, gone.idle_since);
  std::vector<bool> plane_gone(planes_.size(), false);
  plane_gone[static_cast<std::size_t>(a)] = true;
  eliminate(std::vector<bool>(poses_.size(), false), plane_gone, false);
  return true;
}

bool SlidingWindow::set_anchor(PlaneId id, const Eigen::Vector3d& anchor_map) {
  const int at = find(id);
  if (at < 0 || !anchor_map.allFinite()) return false;
  Landmark& plane = planes_[static_cast<std::size_t>(at)];
  const Eigen::Vector3d shift = anchor_map - plane.anchor;
  // rho_new = rho - n.shift, so a step (tilt, rho_new) is (tilt, rho_new + shift^T B tilt) here.
  const auto old_from_new = [&shift](const Chart& chart) {
    Eigen::Matrix3d M = Eigen::Matrix3d::Identity();
    M.bottomLeftCorner<1, 2>() = shift.transpose() * chart.basis;
    return M;
  };
  const auto move_chart = [&shift](Chart& chart) { chart.rho -= chart.normal.dot(shift); };
  for (auto& hold : holds_) {
    if (hold.id != id) continue;
    hold.S = (hold.S * old_from_new(hold.at)).eval();
    move_chart(hold.at);
  }
  for (std::size_t i = 0; i < prior_.planes.size(); ++i) {
    if (prior_.planes[i] != id) continue;
    const auto column = static_cast<Eigen::Index>(6 * prior_.poses.size() + 3 * i);
    prior_.R.middleCols<3>(column) =
        (prior_.R.middleCols<3>(column) * old_from_new(prior_.planes_at[i])).eval();
    prior_.H = gram(prior_.R);
    states_behind_.change_columns(column, old_from_new(prior_.planes_at[i]));
    move_chart(prior_.planes_at[i]);
  }
  move_chart(plane.now);
  move_chart(plane.first);
  plane.anchor = anchor_map;
  solved_ = false;
  return true;
}

// ------------------------------------------------------------------------------- estimates

SE3 SlidingWindow::pose(KeyframeId id) const {
  const int i = find(id);
  LAMINA_CHECK(i >= 0);
  return poses_[static_cast<std::size_t>(i)].now;
}

Plane SlidingWindow::plane_anchor(PlaneId id) const {
  const int i = find(id);
  LAMINA_CHECK(i >= 0);
  const Chart& chart = planes_[static_cast<std::size_t>(i)].now;
  return Plane(chart.normal, chart.rho);
}

std::vector<KeyframeId> SlidingWindow::keyframes() const {
  std::vector<KeyframeId> result;
  for (const auto& pose : poses_) result.push_back(pose.id);
  return result;
}

std::vector<PlaneId> SlidingWindow::planes() const {
  std::vector<PlaneId> result;
  for (const auto& plane : planes_) result.push_back(plane.id);
  return result;
}

}  // namespace lamina
