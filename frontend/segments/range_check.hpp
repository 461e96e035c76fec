// What a file claims of the largest range of a scanner, against what its scans show.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <lamina/sensors/laser_scan.hpp>

namespace lamina {

/// Three claims about range_max that are often wrong, each found by how ranges go from beam to beam
/// over the first scans:
/// - a code for no return below it (9.99 of 10): sectors of one and the same range that no wall
///   has, since a flat one's range grows to the sides;
/// - a reach below it, and chance from there on (a unit of 6 m driven as one of 12): on surfaces,
///   oblique ones too, ranges rise or fall; a return that stands out from both neighbours to the
///   same side is a post, a gap or chance. Nearly none does up to the reach, half of all beyond;
/// - a reach far above it: a tenth of all returns and more lie beyond, and on surfaces.
class RangeCheck {
 public:
  /// A scan as it was measured; the first few hundred count.
  void add(const LaserScan& scan);

  /// m: the range that stands for no return; nullopt: none found.
  std::optional<double> code() const { return code_; }
  /// m: returns from here on are chance.
  std::optional<double> noise_from() const { return noise_from_; }
  /// Returns lie beyond range_max, up to this (m).
  std::optional<double> reach() const { return reach_; }
  /// Share of the returns beyond noise_from() that stand out, and of those before.
  double share_beyond() const { return share_beyond_; }
  double share_before() const { return share_before_; }
  /// As last stated (m).
  double stated() const { return stated_; }
  /// What to use in place of a scan's own range_max (m).
  double range_max(const LaserScan& scan) const;

  template <class A>
  friend void fields(A& a, RangeCheck& v) {
    a(v.seen_, v.apart_, v.flat_, v.scans_, v.beyond_, v.apart_beyond_, v.all_, v.stated_,
      v.largest_, v.code_, v.noise_from_, v.reach_, v.share_beyond_, v.share_before_);
  }

 private:
  static constexpr std::size_t kBins = 110;  // 0.5 m to 100 m, each 5 % wide
  struct Sector {
    std::int64_t scans = 0;  // that had one
    double low = 0;          // m, the least range in any
    template <class A>
    friend void fields(A& a, Sector& v) {
      a(v.scans, v.low);
    }
  };
  void look_for_sectors(const LaserScan& scan);
  void decide();
  void find_code();
  void find_noise();

  std::array<std::int64_t, kBins> seen_{}, apart_{};  // returns with two neighbours, by range
  std::array<Sector, kBins> flat_{};                  // sectors of one range, likewise
  std::int64_t scans_ = 0;
  std::int64_t beyond_ = 0, apart_beyond_ = 0, all_ = 0;  // returns beyond range_max; all
  double stated_ = 0, largest_ = 0;
  std::optional<double> code_, noise_from_, reach_;
  double share_beyond_ = 0, share_before_ = 0;
};

}  // namespace lamina
