// Returns of a scan: breaks between surfaces, roughness, prefix sums.
#include <lamina/frontend/segments/scan_returns.hpp>
#include <lamina/models/median.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lamina {
namespace {
// Beams in a row without a return: fewer may be chance.
constexpr int kLostBeams = 3;
constexpr double kShortRange = 15;  // m
// Half width in beams of the slope that tells a beam's incidence from its neighbours.
constexpr int kSlopeHalfWidth = 4;
// tan(85 deg): more oblique beams are treated alike.
constexpr double kMaxSlope = 11.4;
// Median of |t| for a unit normal t.
constexpr double kNormalMedian = 0.6745;
// Roughness this little above the declared noise is the scatter of the estimate itself.
constexpr double kRoughnessDeadZone = 1.25;
}  // namespace

bool InverseRangeSums::solve(double& A, double& B) const {
  const double det = cc * ss - cs * cs;
  if (count < 2 || !(det > 1e-12 * cc * cc + 1e-12 * ss * ss)) return false;
  A = (qc * ss - qs * cs) / det;
  B = (qs * cc - qc * cs) / det;
  return std::isfinite(A) && std::isfinite(B) && A * A + B * B > 0;
}

void ScanPoints::update_table(const LaserScan& scan) {
  if (scan.angles.empty() && table_c_.size() == scan.size() && table_min_ == scan.angle_min &&
      table_increment_ == scan.angle_increment) {
    return;
  }
  // A straightened scan's table is of that scan alone: no other one begins at "not a number".
  table_min_ = scan.angles.empty() ? scan.angle_min : std::numeric_limits<double>::quiet_NaN();
  table_increment_ = scan.angle_increment;
  table_c_.resize(scan.size());
  table_s_.resize(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    table_c_[i] = std::cos(scan.angle(i));
    table_s_[i] = std::sin(scan.angle(i));
  }
}

int ScanPoints::load(const LaserScan& scan, const SegmentOptions& options) {
  update_table(scan);
  r_.clear();
  q_.clear();
  c_.clear();
  s_.clear();
  beam_.clear();
  beams_ = static_cast<int>(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (!scan.valid(i)) continue;
    r_.push_back(static_cast<double>(scan.ranges[i]));
    q_.push_back(1 / r_.back());
    c_.push_back(table_c_[i]);
    s_.push_back(table_s_[i]);
    beam_.push_back(static_cast<int>(i));
  }
  const double increment = std::abs(scan.angle_increment);
  full_circle_ = beams_ > 8 && increment * (beams_ + 1.5) > 2 * M_PI;
  sigma_r_ = stated_sigma_r_ = std::max(options.min_sigma, scan.lidar.noise.range_sigma);
  sigma_a_ = std::max(0.0, scan.lidar.noise.angle_sigma);
  noise_scale_ = 1;
  find_breaks(increment, scan.range_max, options);
  find_slopes(increment);
  estimate_noise(increment, options);
  accumulate();
  return beams_ - size();
}

// Adaptive break point [Borges2004]: on a surface whose chord makes at least gap_angle with the
// beam, the next return is at most r sin(d) / sin(gap_angle - d) away.
void ScanPoints::find_breaks(double increment, double range_max, const SegmentOptions& options) {
  break_.assign(r_.size(), 0);
  const auto reach_of = [&](double d) {
    const double allowed_angle = std::max(options.gap_angle - d, 0.25 * options.gap_angle);
    return std::sin(std::min(d, M_PI / 2)) / std::sin(allowed_angle);
  };
  const double next_reach = reach_of(increment);
  // A door behind which all is out of range: to a scanner that sees far, beams that do not come
  // back are black or glass more often.
  const bool short_sighted = range_max > 0 && range_max <= kShortRange;
  for (int i = 1; i < size(); ++i) {
    const int beams = beam(i) - beam(i - 1);
    const double reach = beams == 1 ? next_reach : reach_of(increment * beams);
    const double near = std::min(r(i), r(i - 1));
    const double threshold = std::max(options.min_gap, near * reach) + 6 * sigma_r_;
    const double cosine = c(i) * c(i - 1) + s(i) * s(i - 1);
    const double squared = r(i) * r(i) + r(i - 1) * r(i - 1) - 2 * r(i) * r(i - 1) * cosine;
    const bool opening =
        short_sighted && beams > kLostBeams && squared > options.max_bridge * options.max_bridge;
    if (squared > threshold * threshold || opening) break_[at(i)] = 1;
  }
}

// Squared range error (m^2) that the beam's angle makes, by |tan(incidence)| from the ranges a few
// beams to either side.
void ScanPoints::find_slopes(double increment) {
  along_.assign(r_.size(), 0);
  if (!(sigma_a_ > 0) || !(increment > 0)) return;
  for (int i = 0; i < size(); ++i) {
    const int a = std::max(0, i - kSlopeHalfWidth), b = std::min(size() - 1, i + kSlopeHalfWidth);
    if (a == b) continue;
    const double rise = std::abs(r(b) - r(a)) / (increment * (beam(b) - beam(a)));
    const double along = std::min(kMaxSlope * r(i), rise) * sigma_a_;
    along_[at(i)] = along * along;
  }
}

// On any line q[i-1] - 2 cos(d) q[i] + q[i+1] = 0 exactly; the median of its size, in sigmas, tells
// how rough the scan is against the declared noise.
void ScanPoints::estimate_noise(double increment, const SegmentOptions& options) {
  roughness_.clear();
  measured_roughness_.reset();
  const double two_cos = 2 * std::cos(increment), range_variance = sigma_r_ * sigma_r_;
  for (int i = 1; i + 1 < size(); ++i) {
    if (beam(i + 1) - beam(i - 1) != 2 || breaks_before(i) || breaks_before(i + 1)) continue;
    const double p = q(i - 1) * q(i - 1), m = two_cos * q(i) * q(i), n = q(i + 1) * q(i + 1);
    const double variance = (range_variance + along_[at(i)]) * (p * p + m * m + n * n);
    const double t = q(i - 1) - two_cos * q(i) + q(i + 1);
    roughness_.push_back(t * t / variance);
  }
  if (roughness_.size() < 30) return;
  const double scale = std::sqrt(median(roughness_)) / kNormalMedian;
  measured_roughness_ = scale;
  if (scale < kRoughnessDeadZone) return;
  noise_scale_ = std::min(scale, options.max_noise_scale);
  sigma_r_ *= noise_scale_;
}

void ScanPoints::accumulate() {
  prefix_.resize(r_.size() + 1);
  InverseRangeSums sums;
  prefix_[0] = sums;
  const double range_variance = sigma_r_ * sigma_r_;
  for (int i = 0; i < size(); ++i) {
    const double r2 = r(i) * r(i);
    sums.add(r2 * r2 / (range_variance + along_[at(i)]), c(i), s(i), q(i));
    prefix_[at(i) + 1] = sums;
  }
}

}  // namespace lamina
