// Votes of each beam over all pairs, and what stands beside what came along.
#include <lamina/pipeline/calibration/own_returns.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/median.hpp>

namespace lamina {
namespace {

enum class Past { kUnknown, kMet, kSeenPast };

struct Votes {
  std::vector<double> along;   // m, ranges of returns that came along
  std::vector<double> either;  // of those that may have come along or be at rest
  std::vector<double> at_rest;
};

double tolerance(const LaserScan& scan, const OwnReturnOptions& options) {
  return std::max(options.same, options.same_sigmas * scan.lidar.noise.range_sigma);
}

// What the scan says of a place in its frame.
Past look(const LaserScan& scan, const Eigen::Vector2d& place, double off) {
  if (scan.angle_increment == 0) return Past::kUnknown;
  const double turn =
      std::remainder(std::atan2(place.y(), place.x()) - scan.angle_min -
                         0.5 * scan.angle_increment * static_cast<double>(scan.size() - 1),
                     2 * M_PI);
  const double beam = turn / scan.angle_increment + 0.5 * static_cast<double>(scan.size() - 1);
  const auto i = static_cast<std::ptrdiff_t>(std::lround(beam));
  if (i < 0 || i >= static_cast<std::ptrdiff_t>(scan.size())) return Past::kUnknown;
  if (!scan.valid(static_cast<std::size_t>(i))) return Past::kUnknown;
  const double past = static_cast<double>(scan.ranges[static_cast<std::size_t>(i)]) - place.norm();
  return past > off ? Past::kSeenPast : past < -off ? Past::kUnknown : Past::kMet;
}

struct Met {
  double met = 0, past = 0;  // returns of any range, where they would be at rest
};

void vote(const ScanPair& pair, const OwnReturnOptions& options, std::vector<Votes>& votes,
          Met& all) {
  const PlanarPose T_to_from = pair.T_from_to.inverse();
  const double same = tolerance(*pair.from, options);
  for (std::size_t i = 0; i < pair.from->size(); ++i) {
    if (!pair.from->valid(i)) continue;
    const double range = static_cast<double>(pair.from->ranges[i]);
    const Eigen::Vector2d here = pair.from->point(i), there = T_to_from * here;
    const double way = (there - here).norm();
    if (way < options.way) continue;
    const Past past = look(*pair.to, there, options.off + options.off_share * way);
    all.met += past == Past::kMet;
    all.past += past == Past::kSeenPast;
    if (!pair.to->valid(i) || range > options.most_range) continue;
    const bool one = std::abs(static_cast<double>(pair.to->ranges[i]) - range) <= same;
    if (one && past == Past::kSeenPast) votes[i].along.push_back(range);
    if (one && past == Past::kMet) votes[i].either.push_back(range);
    if (!one && past == Past::kMet) votes[i].at_rest.push_back(range);
  }
}

double about(const std::vector<double>& ranges, double middle, double same) {
  return static_cast<double>(std::count_if(ranges.begin(), ranges.end(),
                                           [&](double r) { return std::abs(r - middle) <= same; }));
}

class Judge {
 public:
  Judge(const std::vector<Votes>& votes, double same, const OwnReturnOptions& options)
      : votes_(votes), own_(votes.size()), same_(same), options_(options) {}

  std::vector<OwnBeam> own() {
    for (std::size_t i = 0; i < own_.size(); ++i) judge(i);
    for (std::size_t i = 1; i < own_.size(); ++i) spread(i - 1, i);
    for (std::size_t i = own_.size(); i-- > 1;) spread(i, i - 1);
    const bool any =
        std::any_of(own_.begin(), own_.end(), [](const OwnBeam& beam) { return beam.any(); });
    return any ? own_ : std::vector<OwnBeam>();
  }

 private:
  bool enough(std::size_t i, double range, double along) const {
    return along >= static_cast<double>(options_.least) &&
           along >= options_.times_at_rest * about(votes_[i].at_rest, range, same_);
  }
  void judge(std::size_t i) {
    if (votes_[i].along.size() < options_.least) return;
    const double range = median(votes_[i].along);
    const double along = about(votes_[i].along, range, same_);
    if (enough(i, range, along) &&
        along >= options_.times_either * about(votes_[i].either, range, same_))
      own_[i] = {range - same_, range + same_};
  }
  // The middle of what is broad is seen past by few.
  void spread(std::size_t from, std::size_t to) {
    if (!own_[from].any() || own_[to].any()) return;
    std::vector<double> ranges = votes_[to].along;
    ranges.insert(ranges.end(), votes_[to].either.begin(), votes_[to].either.end());
    if (ranges.size() < options_.least) return;
    const double range = median(ranges);
    const bool beside = range > own_[from].near - same_ && range < own_[from].far + same_;
    if (beside && enough(to, range, about(ranges, range, same_)))
      own_[to] = {range - same_, range + same_};
  }

  const std::vector<Votes>& votes_;
  std::vector<OwnBeam> own_;
  double same_;
  const OwnReturnOptions& options_;
};

}  // namespace

std::vector<OwnBeam> own_returns(std::span<const ScanPair> pairs, const OwnReturnOptions& options) {
  if (pairs.empty()) return {};
  const std::size_t beams = pairs[0].from->size();
  std::vector<Votes> votes(beams);
  Met all;
  for (const ScanPair& pair : pairs) {
    if (pair.from->size() != beams || pair.to->size() != beams) return {};
    vote(pair, options, votes, all);
  }
  if (all.met < options.met * (all.met + all.past)) return {};
  return Judge(votes, tolerance(*pairs[0].from, options), options).own();
}

}  // namespace lamina
