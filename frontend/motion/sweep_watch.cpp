// Velocities between neighbours; when to ask.
#include <lamina/frontend/motion/sweep_watch.hpp>

#include <cmath>
#include <utility>

namespace lamina {

void SweepWatch::add(const LaserScan& scan, const std::optional<SE3>& moved, bool finely) {
  if (!moved) before_.reset();
  Placed now{scan, last_ && moved ? last_->T_start_body * *moved : SE3()};
  if (last_ && before_ && moved) {
    const double before = last_->scan.stamp - before_->scan.stamp;
    const double after = now.scan.stamp - last_->scan.stamp;
    const SE3 way = before_->T_start_body.inverse() * now.T_start_body;
    Vector6d velocity = way.log() / (before + after), acceleration = Vector6d::Zero();
    if (finely && before > 0 && after > 0) {
      const SE3 way_before = before_->T_start_body.inverse() * last_->T_start_body;
      const Vector6d v_before = way_before.log() / before, v_after = moved->log() / after;
      velocity = (after * v_before + before * v_after) / (before + after);
      acceleration = 2 / (before + after) * (v_after - v_before);
    }
    finder_.add(last_->scan, planar_part(last_->T_start_body), velocity, acceleration);
  }
  before_ = moved ? std::move(last_) : std::nullopt;
  last_ = std::move(now);
}

std::optional<SweepFinder::Found> SweepWatch::found_on_the_way() {
  if (done_) return std::nullopt;
  const bool all = !wants_more();
  if (!all && finder_.pairs() < ask_at_) return std::nullopt;
  ask_at_ = 2 * ask_at_;
  const auto found = finder_.found();
  constexpr double kSure = 0.05;  // of the sweep, 1-sigma
  const bool adopted = found && found->adoption.adopted;
  if (all || (adopted && found->sigma < kSure * std::abs(found->sweep))) {
    *this = SweepWatch();  // its scans are needed no more
    done_ = true;
  }
  return adopted ? found : std::nullopt;
}

}  // namespace lamina
