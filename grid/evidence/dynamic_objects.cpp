// A few looks at a time, in squares of the ground.
#include <lamina/grid/evidence/dynamic_objects.hpp>

#include <cmath>

#include <lamina/models/checked_cast.hpp>

namespace lamina {
namespace {

constexpr double kSquare = 0.05;     // m
constexpr std::int64_t kReach = 10;  // squares: half a metre, a person's width, arms and all
constexpr double kNear = 0.3;        // s: a look before or after, at five a second
constexpr double kStood = 2;         // s in sight of one place: people walk on
constexpr int kFewest = 4;           // places that have gone
constexpr int kShare = 5;

std::int64_t index(double x) { return to_far_cell(x / kSquare); }

}  // namespace

void Movers::add(Timestamp stamp, const std::vector<MetPlace>& met) {
  while (observed_ < looks_.size() && std::abs(stamp - looks_[observed_].stamp) > kNear)
    tell(looks_[observed_++]);
  while (observed_ > 0 && (observed_ == looks_.size() ||
                           std::abs(looks_[observed_].stamp - looks_.front().stamp) > kNear)) {
    looks_.pop_front();
    --observed_;
  }
  Look& look = looks_.emplace_back();
  look.stamp = stamp;
  for (const MetPlace& m : met) {
    const Eigen::Vector3d& p = m.column->at_map(m.place);
    const bool gone = m.column->free_again(m.place);
    if (!gone) look.open.push_back(m);
    if (!gone && m.column->met_for(m.place) <= kStood) continue;
    Count& count = look.cells[{index(p.x()), index(p.y())}];
    ++(gone ? count.gone : count.stood);
    look.gone += gone;
  }
}

void Movers::finish() {
  while (observed_ < looks_.size()) tell(looks_[observed_++]);
  looks_.clear();
  observed_ = 0;
}

void Movers::tell(const Look& look) {
  for (const MetPlace& m : look.open) {
    const Eigen::Vector3d& p = m.column->at_map(m.place);
    for (const Look& other : looks_) {
      if (std::abs(other.stamp - look.stamp) > kNear || !beside(other, p)) continue;
      m.column->count_beside(m.place);
      break;
    }
  }
}

bool Movers::beside(const Look& look, const Eigen::Vector3d& p) const {
  if (look.gone < kFewest) return false;  // as most looks are, where nobody walks
  const std::int64_t i = index(p.x()), j = index(p.y());
  const auto [answer, is_new] = look.beside.try_emplace({i, j}, false);
  if (!is_new) return answer->second;
  Count sum;
  for (std::int64_t a = i - kReach; a <= i + kReach; ++a) {
    for (auto cell = look.cells.lower_bound({a, j - kReach});
         cell != look.cells.end() && cell->first <= Cell{a, j + kReach}; ++cell) {
      const std::int64_t di = a - i, dj = cell->first.second - j;
      if (di * di + dj * dj > kReach * kReach) continue;
      sum.gone += cell->second.gone;
      sum.stood += cell->second.stood;
    }
  }
  answer->second = sum.gone >= kFewest && kShare * sum.gone >= sum.gone + sum.stood;
  return answer->second;
}

}  // namespace lamina
