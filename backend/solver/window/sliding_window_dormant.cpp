// Planes that left the window and may come back.
#include <lamina/backend/solver/window/sliding_window.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace lamina {

// Follows an elimination, with the prior as it was before.
void SlidingWindow::leave_behind(const EliminationOrder& order, const SquareRootInformation& left,
                                 const std::vector<bool>& plane_gone, bool remember) {
  if (!left.eliminated || left.R.rows() == 0) {
    behind_.clear();
    states_behind_.clear();
    return;
  }
  const std::size_t border = state_.poses.size();
  const Eigen::Index old = states_behind_.size();
  Eigen::Index rows = old;
  if (remember && options_.planes_behind > 0) {
    for (const bool gone : plane_gone) rows += gone ? 3 : 0;
  }
  if (rows == 0) return;
  Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(rows, order.columns());
  Eigen::Index column = 0;
  const auto carry = [&](int variable, Eigen::Index width) {
    if (old > 0) {
      gain.block(0, order.column[static_cast<std::size_t>(variable)], old, width) =
          states_behind_.gain().middleCols(column, width);
    }
    column += width;
  };
  for (const KeyframeId id : state_.prior.poses) carry(find(id), 6);
  for (const PlaneId id : state_.prior.planes) carry(static_cast<int>(border) + find(id), 3);
  Eigen::Index row = old;
  for (std::size_t i = 0; i < state_.planes.size() && row < rows; ++i) {
    if (!plane_gone[i]) continue;
    gain.block<3, 3>(row, order.column[border + i]).setIdentity();
    behind_.push_back(state_.planes[i]);
    if (!behind_.back().frozen) behind_.back().first = behind_.back().now;
    row += 3;
  }
  states_behind_.eliminate(old > 0 ? state_.prior_step() : Eigen::VectorXd(), std::move(gain),
                           *left.eliminated);
  while (behind_.size() > static_cast<std::size_t>(options_.planes_behind)) {
    const auto longest = std::min_element(behind_.begin(), behind_.end(),
                                          [](const window::Landmark& a, const window::Landmark& b) {
                                            return a.idle_since < b.idle_since;
                                          });
    states_behind_.drop(3 * (longest - behind_.begin()));
    remove_behind(longest - behind_.begin());
  }
}

// As the states do: the last one takes the place.
void SlidingWindow::remove_behind(std::ptrdiff_t at) {
  behind_[static_cast<std::size_t>(at)] = behind_.back();
  behind_.pop_back();
}

void SlidingWindow::forget(PlaneId id) {
  const auto at = std::find_if(behind_.begin(), behind_.end(),
                               [id](const window::Landmark& plane) { return plane.id == id; });
  if (at == behind_.end()) return;
  states_behind_.drop(3 * (at - behind_.begin()));
  remove_behind(at - behind_.begin());
}

bool SlidingWindow::take_back(PlaneId id, const Plane& plane_anchor,
                              const Eigen::Vector3d& anchor_map) {
  constexpr double kSame = 1e-9;
  const auto at = std::find_if(behind_.begin(), behind_.end(),
                               [id](const window::Landmark& plane) { return plane.id == id; });
  if (at == behind_.end()) return false;
  // Somebody else has estimated it since: what it was no longer counts.
  if ((at->anchor - anchor_map).norm() > kSame ||
      (at->now.n - plane_anchor.normal()).norm() > kSame ||
      std::abs(at->now.rho - plane_anchor.rho()) > kSame) {
    return false;
  }
  const auto row = static_cast<Eigen::Index>(3 * (at - behind_.begin()));
  const Eigen::Vector3d step = states_behind_.mean(state_.prior_step()).segment<3>(row);
  const auto tie = states_behind_.take(row);
  if (!tie) return false;
  window::Landmark plane = *at;
  remove_behind(at - behind_.begin());
  state_.prior.planes.push_back(id);
  state_.prior.planes_at.push_back(plane.now);
  plane.now = plane.now.carried(step);
  plane.frozen = true;
  plane.idle_since = keyframes_added_;
  state_.planes.push_back(plane);
  const Eigen::Index rows = state_.prior.R.rows(), columns = state_.prior.R.cols();
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(rows + 3, columns + 3);
  R.topLeftCorner(rows, columns) = state_.prior.R;
  R.bottomRows(3) = tie->R;
  state_.prior.R = std::move(R);
  state_.prior.r.conservativeResize(rows + 3);
  state_.prior.r.tail(3) = tie->r;
  state_.prior.H = gram(state_.prior.R);
  state_.prior.serial = state_.next_serial();
  solved_ = false;
  return true;
}

}  // namespace lamina
