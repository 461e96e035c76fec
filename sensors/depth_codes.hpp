// Raw depths that are no depths: codes for no measurement, and images stretched each to its range.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lamina/models/warning.hpp>

namespace lamina {

/// All bits of 16-bit depth set: no depth, whatever its unit. Taken out by readers.
class SaturatedDepths {
 public:
  void drop(std::vector<std::uint16_t>& raw);
  /// Where a thousandth of the pixels and more were.
  std::optional<Warning> warning() const;

 private:
  std::int64_t pixels_ = 0, saturated_ = 0, images_ = 0;
};

/// Histogram of the raw depths of some tens of images, and what each alone reaches.
class DepthCodes {
 public:
  void add(const std::vector<std::uint16_t>& raw);
  std::size_t images() const { return images_.size(); }
  /// A code: one value, to 0.1 %, in a quarter of the images and at least five of them, .2 % of all
  /// pixels, beyond which hardly any pixel lies (1 %), with a twentieth of its number at most
  /// beside it (3 %), while what the images show varies (a wall met head-on at one distance is no
  /// code).
  struct Code {
    std::uint16_t least = 0, most = 0;
    double share = 0;  ///< of the measured pixels
  };
  std::optional<Code> code() const;
  /// The one largest value (to .3 %) that images that differ reach, four in five, with few pixels
  /// (1 %) there: each was stretched to the whole range, or the camera measures no further.
  std::optional<double> common_largest() const;
  /// Median of the raw depths; 0 where there are none.
  double median() const;

 private:
  struct Image {
    std::uint16_t largest = 0, median = 0;
    std::vector<std::uint16_t> frequent;  // values with a fiftieth of a percent of its pixels
    double at_largest = 0;                // share of pixels
  };
  bool varies(const std::vector<std::uint16_t>& medians) const;

  std::vector<std::int64_t> counts_ = std::vector<std::int64_t>(65536, 0);
  std::vector<Image> images_;
};

}  // namespace lamina
