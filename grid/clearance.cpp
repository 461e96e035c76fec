// Distance transform.
#include <lamina/grid/clearance.hpp>

#include <cmath>
#include <limits>

namespace lamina {
namespace {

constexpr float kFar = 1e12F;

// Squared distance transform of one line: the lower envelope of parabolas [Felzenszwalb2012].
class Envelope {
 public:
  explicit Envelope(std::size_t n) : value_(n), apex_(n), from_(n + 1) {}
  template <class Line>
  void transform(int n, Line&& line) {
    for (int q = 0; q < n; ++q) value_[static_cast<std::size_t>(q)] = line(q);
    int k = -1;
    for (int q = 0; q < n; ++q) {
      double s = -std::numeric_limits<double>::infinity();
      for (; k >= 0; --k) {
        s = meet(apex_[static_cast<std::size_t>(k)], q);
        if (s > from_[static_cast<std::size_t>(k)]) break;
        s = -std::numeric_limits<double>::infinity();
      }
      ++k;
      apex_[static_cast<std::size_t>(k)] = q;
      from_[static_cast<std::size_t>(k)] = s;
      from_[static_cast<std::size_t>(k) + 1] = std::numeric_limits<double>::infinity();
    }
    k = 0;
    for (int q = 0; q < n; ++q) {
      while (from_[static_cast<std::size_t>(k) + 1] < q) ++k;
      const int p = apex_[static_cast<std::size_t>(k)];
      line(q) = value_[static_cast<std::size_t>(p)] + static_cast<float>((q - p) * (q - p));
    }
  }

 private:
  double meet(int p, int q) const {
    const auto at = [this](int k) {
      return static_cast<double>(value_[static_cast<std::size_t>(k)]);
    };
    const double a = p, b = q;
    return (at(q) - at(p) + b * b - a * a) / (2 * (b - a));
  }
  std::vector<float> value_;
  std::vector<int> apex_;
  std::vector<double> from_;
};

}  // namespace

std::vector<float> clearance_image(const NavigabilityGrid& grid, const GridGeometry& g) {
  // One more cell around: what is outside is not navigable.
  const int w = g.width + 2, h = g.height + 2;
  std::vector<float> wide(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0.0F);
  const auto at = [&](int u, int v) -> float& {
    return wide[static_cast<std::size_t>(v) * static_cast<std::size_t>(w) +
                static_cast<std::size_t>(u)];
  };
  grid.for_each([&](const CellIndex& c, const NavigabilityCell& cell) {
    if (g.contains(c) && cell.navigability > 0) at(c.i - g.first.i + 1, c.j - g.first.j + 1) = kFar;
  });
  Envelope envelope(static_cast<std::size_t>(std::max(w, h)));
  for (int u = 0; u < w; ++u) {
    envelope.transform(h, [&](int v) -> float& { return at(u, v); });
  }
  for (int v = 0; v < h; ++v) {
    envelope.transform(w, [&](int u) -> float& { return at(u, v); });
  }
  std::vector<float> image(static_cast<std::size_t>(g.width) * static_cast<std::size_t>(g.height));
  for (int v = 0; v < g.height; ++v) {
    for (int u = 0; u < g.width; ++u) {
      image[g.image_index({g.first.i + u, g.first.j + v})] =
          std::sqrt(at(u + 1, v + 1)) * static_cast<float>(g.resolution);
    }
  }
  return image;
}

}  // namespace lamina
