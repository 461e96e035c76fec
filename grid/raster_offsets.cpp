// How well planes tell the floor around a tile.
#include <algorithm>
#include <cmath>

#include <lamina/grid/raster_shapes.hpp>

namespace lamina::raster {
namespace {

constexpr double kSigmaOfMedian = 1.4826;  // of a normal's absolute deviations

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void LocalOffsets::sort() {
  std::stable_sort(surfels_.begin(), surfels_.end(), [](const Surfel* a, const Surfel* b) {
    return a->parent_plane < b->parent_plane;
  });
}

LocalOffsets::Offset LocalOffsets::of(const MapPlane& plane) const {
  const Eigen::Vector3d& n = plane.plane_map.normal();
  auto it = std::lower_bound(surfels_.begin(), surfels_.end(), plane.id,
                             [](const Surfel* s, std::int64_t id) { return s->parent_plane < id; });
  std::vector<double> above;
  for (; it != surfels_.end() && (*it)->parent_plane == plane.id; ++it) {
    above.push_back(n.dot((*it)->center - plane.centroid_map) / n.z());
  }
  if (above.empty()) return {};
  const double middle = median(above);
  for (double& d : above) d = std::abs(d - middle);
  const double sigma = kSigmaOfMedian * median(above);
  Offset offset;
  const auto count = static_cast<double>(above.size());
  offset.count += count;
  offset.mean = middle * count / offset.count;
  offset.squares = count * sigma * sigma + middle * offset.mean;
  return offset;
}

}  // namespace lamina::raster
