// Sets of cells of one tile.
#include <lamina/grid/raster_mask.hpp>

#include <lamina/models/error.hpp>

namespace lamina::raster {

std::array<CellMask, 9> grown(const CellMask& cells, int margin) {
  static_assert(kSide == 32);
  LAMINA_CHECK(margin >= 0 && margin <= kSide / 2);
  std::array<CellMask, 9> around;
  for (int j = 0; j < kSide; ++j) {
    const std::uint64_t row = cells.rows[static_cast<std::size_t>(j)];
    if (row == 0) continue;
    std::uint64_t wide = 0;  // bit k: cell k - 16
    for (int d = -margin; d <= margin; ++d) wide |= row << static_cast<unsigned>(16 + d);
    const std::array<std::uint32_t, 3> parts = {static_cast<std::uint32_t>(wide << 16U),
                                                static_cast<std::uint32_t>(wide >> 16U),
                                                static_cast<std::uint32_t>(wide >> 48U)};
    for (int v = j - margin + kSide; v <= j + margin + kSide; ++v) {
      const auto band = static_cast<std::size_t>(v / kSide),
                 at = static_cast<std::size_t>(v % kSide);
      for (std::size_t part = 0; part < 3; ++part) around[3 * band + part].rows[at] |= parts[part];
    }
  }
  return around;
}

}  // namespace lamina::raster
