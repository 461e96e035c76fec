// Cells that the rays of one scan touch, each once.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include <lamina/grid/grid_geometry.hpp>

namespace lamina {

/// What a scan says of a cell; of several, the greater stands.
enum class Touch : std::uint8_t {
  kNone,
  kCrossed,  ///< a ray ended within its next 0.3 m
  kPassed,   ///< a ray went on for 0.3 m or more
  kMarked    ///< a ray ended there
};

struct CellTouch {
  CellIndex cell;
  Touch touch = Touch::kNone;
};

/// A byte a cell in a square about the scanner, and a list of those that are not kNone: a scan's
/// rays touch cells near the scanner again and again. Buffers are kept from scan to scan.
class TouchedCells {
 public:
  /// Forgets what was touched. `centre` and `reach` (m): touch() takes cells within.
  void begin(const Eigen::Vector2d& centre, double reach, double resolution) {
    for (const CellIndex& c : cells_) bytes_[index(c)] = Touch::kNone;
    cells_.clear();
    const auto cells = static_cast<std::int32_t>(std::ceil(reach / resolution)) + 2;
    const CellIndex middle = cell_of(centre, resolution);
    first_ = {middle.i - cells, middle.j - cells};
    width_ = 2 * static_cast<std::size_t>(cells) + 1;
    if (bytes_.size() < width_ * width_) bytes_.resize(width_ * width_, Touch::kNone);
  }

  void touch(const CellIndex& c, Touch touch) {
    Touch& byte = bytes_[index(c)];
    if (byte == Touch::kNone) cells_.push_back(c);
    if (byte < touch) byte = touch;
  }

  /// In the order in which they were touched first.
  std::vector<CellTouch> all() const {
    std::vector<CellTouch> touches;
    touches.reserve(cells_.size());
    for (const CellIndex& c : cells_) touches.push_back({c, bytes_[index(c)]});
    return touches;
  }

 private:
  std::size_t index(const CellIndex& c) const {
    return static_cast<std::size_t>(c.j - first_.j) * width_ +
           static_cast<std::size_t>(c.i - first_.i);
  }

  CellIndex first_{0, 0};
  std::size_t width_ = 1;
  std::vector<Touch> bytes_{Touch::kNone};
  std::vector<CellIndex> cells_;
};

}  // namespace lamina
