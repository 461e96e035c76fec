// A path as text and picture.
#include <lamina/io/path_files.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/image_files.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

using Colour = std::array<std::uint8_t, 3>;
constexpr Colour kUnknown{150, 160, 175}, kPath{220, 30, 30}, kStart{20, 160, 60},
    kGoal{40, 80, 230};

/// A picture over a rectangle of cells, `scale` pixels a cell, row 0 at the largest y.
class Picture {
 public:
  explicit Picture(const GridGeometry& geometry) : g_(geometry) {
    scale_ = std::clamp(400 / std::max({g_.width, g_.height, 1}), 1, 16);
    width_ = g_.width * scale_;
    height_ = g_.height * scale_;
    pixels_.resize(3 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  }
  void put(int u, int v, const Colour& colour) {
    if (u < 0 || v < 0 || u >= width_ || v >= height_) return;
    const auto k = 3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) +
                        static_cast<std::size_t>(u));
    for (std::size_t c = 0; c < 3; ++c) pixels_[k + c] = colour[c];
  }
  void fill(const CellIndex& c, const Colour& colour) {
    const int u0 = (c.i - g_.first.i) * scale_;
    const int v0 = (g_.height - 1 - (c.j - g_.first.j)) * scale_;
    for (int v = v0; v < v0 + scale_; ++v) {
      for (int u = u0; u < u0 + scale_; ++u) put(u, v, colour);
    }
  }
  Eigen::Vector2d pixel(const Eigen::Vector2d& p_map) const {
    const Eigen::Vector2d cells = (p_map - g_.origin()) / g_.resolution;
    return {cells.x() * scale_, (g_.height - cells.y()) * scale_};
  }
  void dot(const Eigen::Vector2d& p_map, double radius, const Colour& colour) {
    const Eigen::Vector2d middle = pixel(p_map);
    const Eigen::Vector2d low(-radius, -radius), high(width_ + radius, height_ + radius);
    if (!((middle - low).minCoeff() >= 0 && (high - middle).minCoeff() >= 0)) return;
    for (int v = static_cast<int>(middle.y() - radius); v <= middle.y() + radius; ++v) {
      for (int u = static_cast<int>(middle.x() - radius); u <= middle.x() + radius; ++u) {
        if (std::hypot(u + 0.5 - middle.x(), v + 0.5 - middle.y()) <= radius) put(u, v, colour);
      }
    }
  }
  void line(const Eigen::Vector2d& a_map, const Eigen::Vector2d& b_map, const Colour& colour) {
    const int n = 1 + static_cast<int>(2 * (pixel(b_map) - pixel(a_map)).norm());
    for (int k = 0; k <= n; ++k) {
      dot(a_map + (b_map - a_map) * (k / static_cast<double>(n)), 1.0, colour);
    }
  }
  void write(const std::filesystem::path& file) const {
    const std::size_t bytes = 3 * static_cast<std::size_t>(width_);
    write_png(file, width_, height_, 3, [&](int y, std::uint8_t* row) {
      std::copy_n(pixels_.data() + static_cast<std::size_t>(y) * bytes, bytes, row);
    });
  }

 private:
  GridGeometry g_;
  int scale_ = 1, width_ = 0, height_ = 0;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace

void write_path_csv(const std::filesystem::path& file,
                    const std::vector<Eigen::Vector2d>& path_map) {
  std::string text = "x,y\n";
  for (const Eigen::Vector2d& p : path_map) text += fmt::format("{:.4f},{:.4f}\n", p.x(), p.y());
  write_atomically(file, text);
}

std::vector<Eigen::Vector2d> read_path_csv(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw Error(file.string() + ": cannot be read, expected a planned path");
  std::vector<Eigen::Vector2d> path;
  std::string line;
  std::getline(in, line);
  for (int number = 2; std::getline(in, line); ++number) {
    std::istringstream text(line);
    Eigen::Vector2d p;
    char comma = 0;
    if (!(text >> p.x() >> comma >> p.y()) || comma != ',') {
      throw Error(fmt::format("{}:{}: found '{}', expected x,y", file.string(), number, line));
    }
    path.push_back(p);
  }
  return path;
}

void write_path_png(const std::filesystem::path& file, const NavigabilityGrid& grid,
                    const std::vector<Eigen::Vector2d>& path_map, bool line) {
  GridGeometry g = known_bounds(grid);
  if (g.empty()) g.width = g.height = 1;
  Picture picture(g);
  for (int j = g.first.j; j < g.first.j + g.height; ++j) {
    for (int i = g.first.i; i < g.first.i + g.width; ++i) {
      const NavigabilityCell* cell = grid.find({i, j});
      if (cell == nullptr || !cell->known()) {
        picture.fill({i, j}, kUnknown);
        continue;
      }
      const auto value = static_cast<std::uint8_t>(
          std::lround(255.0F * std::clamp(cell->navigability, 0.0F, 1.0F)));
      picture.fill({i, j}, {value, value, value});
    }
  }
  for (std::size_t k = 1; line && k < path_map.size(); ++k) {
    picture.line(path_map[k - 1], path_map[k], kPath);
  }
  if (!path_map.empty()) {
    picture.dot(path_map.front(), 4, kStart);
    picture.dot(path_map.back(), 4, kGoal);
  }
  picture.write(file);
}

}  // namespace lamina::io
