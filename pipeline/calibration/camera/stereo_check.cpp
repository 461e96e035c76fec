// Matches pairs as they are and otherwise.
#include <lamina/pipeline/calibration/camera/stereo_check.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/depth/mounting_check.hpp>

namespace lamina {
namespace {

// rad/s about a pair, by wheels; nullopt where they do not tell.
std::optional<double> turn_rate(const std::vector<PairView>& pairs, std::size_t i) {
  if (i == 0 || !pairs[i].T_odom_body || !pairs[i - 1].T_odom_body) return std::nullopt;
  const double dt = pairs[i].pair.stamp - pairs[i - 1].pair.stamp;
  const SE3 T = pairs[i - 1].T_odom_body->inverse() * *pairs[i].T_odom_body;
  return dt > 0 ? std::optional(std::abs(T.so3().log().z()) / dt) : std::nullopt;
}

// The floors of some pairs, right (or left) images `late` pairs on.
class Floors {
 public:
  Floors(const std::vector<PairView>& pairs, const FloorOptions& options)
      : pairs_(pairs), frontend_(options) {}
  MountingHypothesis of(const std::vector<std::size_t>& which, int late) {
    MountingCheck check(pairs_.front().pair.camera.camera.T_body_camera, true);
    for (const std::size_t i : which) {
      StereoFrame pair = pairs_[i].pair;
      const StereoFrame& later = pairs_[i + static_cast<std::size_t>(std::abs(late))].pair;
      (late < 0 ? pair.left : pair.right) = late < 0 ? later.left : later.right;
      const DepthFrame frame = depth_from_stereo(pair);
      frontend_.reset();
      MountingView view;
      for (const ExtractedPlane& p : frontend_.process(frame).planes) {
        view.planes.push_back({p.plane_camera, static_cast<double>(p.pixels) /
                                                   static_cast<double>(frame.raw.size())});
      }
      check.add(std::move(view));
    }
    return check.as_stated();
  }

 private:
  const std::vector<PairView>& pairs_;
  FloorFrontend frontend_;
};

// Straight on, every delay fits.
void check_turns(const std::vector<PairView>& pairs, const FloorOptions& options,
                 StereoFindings& found) {
  constexpr double kTurns = 0.15, kStraight = 0.03;  // rad/s
  constexpr std::size_t kMost = 12, kLeast = 4, kLatest = 2;
  std::vector<std::size_t> turns, straight;
  for (std::size_t i = 1; i + kLatest < pairs.size(); ++i) {
    const auto rate = turn_rate(pairs, i);
    const auto next = turn_rate(pairs, i + 1);
    if (rate && next && std::min(*rate, *next) > kTurns && turns.size() < kMost) turns.push_back(i);
    if (rate && next && std::max(*rate, *next) < kStraight && straight.size() < kMost / 2) {
      straight.push_back(i);
    }
  }
  found.turns = turns.size();
  if (turns.size() < kLeast) return;
  Floors floors(pairs, options);
  const MountingHypothesis as_is = floors.of(turns, 0);
  found.floors = as_is.floors;
  if (2 * as_is.floors >= turns.size()) return;
  double best = as_is.cost - MountingCheckOptions().wins_by;
  for (const int late : {1, -1, 2, -2}) {
    const MountingHypothesis other = floors.of(turns, late);
    if (other.cost >= best || 2 * other.floors < turns.size()) continue;
    best = other.cost;
    found.right_late = late;
    found.floors_later = other.floors;
  }
  found.turns_misfit = found.right_late == 0 && straight.size() >= kLeast / 2 &&
                       2 * floors.of(straight, 0).floors > straight.size();
}

}  // namespace

StereoFindings check_pairs(const std::vector<PairView>& pairs, const FloorOptions& options) {
  constexpr std::size_t kAsked = 8;
  StereoFindings found;
  const std::size_t step = std::max<std::size_t>(1, pairs.size() / kAsked);
  for (std::size_t i = 0; i < pairs.size(); i += step) {
    ++found.asked;
    found.matched += matched_share(pairs[i].pair);
    found.swapped += is_swapped(pairs[i].pair);
  }
  if (found.asked > 0) found.matched /= static_cast<double>(found.asked);
  if (found.swapped == 0) {
    check_turns(pairs, options, found);
    return found;
  }
  std::vector<PairView> mended = pairs;
  for (PairView& view : mended) {
    if (found.all_swapped() || is_swapped(view.pair)) std::swap(view.pair.left, view.pair.right);
  }
  check_turns(mended, options, found);
  return found;
}

}  // namespace lamina
