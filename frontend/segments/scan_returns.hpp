// The returns of one scan, ready for line fits in constant time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include <lamina/frontend/segments/segment_options.hpp>
#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// Weighted sums of a run of returns. In inverse range q = 1/r a line is linear in its unknowns,
///   q = A cos(a) + B sin(a),   rho = 1 / |(A, B)|,  theta = atan2(B, A),
/// and range noise is sigma_q = sigma / r^2 whatever the incidence, so the least-squares line of a
/// run and its chi-squared are closed forms of six sums.
struct InverseRangeSums {
  double cc = 0, cs = 0, ss = 0, qc = 0, qs = 0, qq = 0;
  int count = 0;

  void add(double w, double c, double s, double q) {
    const double wc = w * c, ws = w * s;
    cc += wc * c;
    cs += wc * s;
    ss += ws * s;
    qc += wc * q;
    qs += ws * q;
    qq += w * q * q;
    ++count;
  }
  InverseRangeSums operator-(const InverseRangeSums& o) const {
    return {cc - o.cc, cs - o.cs, ss - o.ss, qc - o.qc, qs - o.qs, qq - o.qq, count - o.count};
  }
  InverseRangeSums operator+(const InverseRangeSums& o) const {
    return {cc + o.cc, cs + o.cs, ss + o.ss, qc + o.qc, qs + o.qs, qq + o.qq, count + o.count};
  }
  /// Chi-squared of the best line; 0 for up to two returns.
  double cost() const {
    if (count <= 2) return 0;
    const double det = cc * ss - cs * cs;
    if (!(det > 1e-12 * (cc * cc + ss * ss))) return qq;
    return std::max(0.0, qq - (qc * qc * ss - 2 * qc * qs * cs + qs * qs * cc) / det);
  }
  /// (A, B) of the best line; false when the returns do not determine it.
  bool solve(double& A, double& B) const;
};

/// Valid returns in beam order, with direction, noise and prefix sums. Keeps its buffers and its
/// table of sines from scan to scan: nothing is allocated for a scan of known geometry.
class ScanPoints {
 public:
  /// Reads a scan; returns how many beams had no usable return.
  int load(const LaserScan& scan, const SegmentOptions& options);

  int size() const { return static_cast<int>(r_.size()); }
  double r(int i) const { return r_[at(i)]; }
  double q(int i) const { return q_[at(i)]; }  ///< 1 / r
  double c(int i) const { return c_[at(i)]; }
  double s(int i) const { return s_[at(i)]; }
  int beam(int i) const { return beam_[at(i)]; }
  /// sigma of the range, of the beam's direction, with the scan's own roughness taken in.
  double sigma_r() const { return sigma_r_; }
  double sigma_a() const { return sigma_a_; }
  double noise_scale() const { return noise_scale_; }
  /// sigma of the range as the scan's model states it (m, at least options.min_sigma).
  double stated_sigma_r() const { return stated_sigma_r_; }
  /// How many times rougher than stated the scan is; nullopt where too few returns tell.
  const std::optional<double>& roughness() const { return measured_roughness_; }
  /// True where return i does not continue the surface of return i - 1.
  bool breaks_before(int i) const { return break_[at(i)] != 0; }
  /// True when the last beam is the first one's neighbour.
  bool full_circle() const { return full_circle_; }
  int beams() const { return beams_; }
  Eigen::Vector2d point(int i) const { return {r(i) * c(i), r(i) * s(i)}; }
  /// Sums of returns [begin, end).
  InverseRangeSums sums(int begin, int end) const { return prefix_[at(end)] - prefix_[at(begin)]; }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  void update_table(const LaserScan& scan);
  void find_breaks(double increment, double range_max, const SegmentOptions& options);
  void estimate_noise(double increment, const SegmentOptions& options);
  void find_slopes(double increment);
  void accumulate();

  double table_min_ = 0, table_increment_ = 0;
  std::vector<double> table_c_, table_s_;
  std::vector<double> r_, q_, c_, s_, along_, roughness_;
  std::vector<int> beam_;
  std::vector<std::uint8_t> break_;
  std::vector<InverseRangeSums> prefix_;
  double sigma_r_ = 0.01, stated_sigma_r_ = 0.01, sigma_a_ = 0, noise_scale_ = 1;
  std::optional<double> measured_roughness_;
  bool full_circle_ = false;
  int beams_ = 0;
};

}  // namespace lamina
