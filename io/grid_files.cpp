// Grids as images and YAML.
#include <lamina/io/grid_files.hpp>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <ostream>
#include <vector>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/image_files.hpp>
#include <lamina/io/map_folder.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

constexpr const char* kLayers[] = {"height", "slope", "navigability", "confidence"};

std::string map_yaml(const GridGeometry& g, const std::string& image, const std::string& mode) {
  const Eigen::Vector2d origin = g.origin();
  return fmt::format(
      "image: {}\nmode: {}\nresolution: {}\norigin: [{}, {}, 0]\nnegate: 0\n"
      "occupied_thresh: 0.65\nfree_thresh: 0.196\n",
      image, mode, g.resolution, origin.x(), origin.y());
}

float NavigabilityCell::*layer_of(std::size_t index) {
  constexpr float NavigabilityCell::*kMembers[] = {
      &NavigabilityCell::height, &NavigabilityCell::slope, &NavigabilityCell::navigability,
      &NavigabilityCell::confidence};
  return kMembers[index];
}

// NAME.pgm and NAME.yaml; `fill` writes a row of pixels, row 0 at the largest y.
void write_pgm_map(const std::filesystem::path& folder, const std::string& name,
                   const std::string& mode, const GridGeometry& g,
                   const std::function<void(int row, std::string& pixels)>& fill) {
  std::string pixels(static_cast<std::size_t>(g.width), '\0');
  write_atomically(folder / (name + ".pgm"), [&](std::ostream& out) {
    out << fmt::format("P5\n{} {}\n255\n", g.width, g.height);
    for (int y = 0; y < g.height; ++y) {
      fill(y, pixels);
      out.write(pixels.data(), static_cast<std::streamsize>(pixels.size()));
    }
  });
  write_atomically(folder / (name + ".yaml"), map_yaml(g, name + ".pgm", mode));
}

// An empty map is still a file that readers accept: one unknown cell.
GridGeometry at_least_one_cell(GridGeometry g) {
  if (g.empty()) g.width = g.height = 1;
  return g;
}

GridGeometry read_geometry(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) {
    throw Error(file.string() + ": found no such file, expected grid.yaml of a map");
  }
  try {
    const YAML::Node yaml = YAML::LoadFile(file.string());
    GridGeometry g;
    g.resolution = yaml["resolution"].as<double>();
    g.width = yaml["width"].as<int>();
    g.height = yaml["height"].as<int>();
    if (!(g.resolution > 0) || g.empty()) {
      throw Error(file.string() + ": found an empty grid, expected resolution, width, height > 0");
    }
    g.first = {
        static_cast<std::int32_t>(std::lround(yaml["origin"][0].as<double>() / g.resolution)),
        static_cast<std::int32_t>(std::lround(yaml["origin"][1].as<double>() / g.resolution))};
    return g;
  } catch (const YAML::Exception& error) {
    throw Error(file.string() + ": " + error.what() + ", expected grid.yaml of a map");
  }
}

}  // namespace

void write_grid(const std::filesystem::path& folder, const NavigabilityGrid& grid) {
  const GridGeometry g = at_least_one_cell(known_bounds(grid));
  make_output_folder(folder);
  const Eigen::Vector2d origin = g.origin();
  const RasterPlace place{g.resolution, {origin.x(), origin.y() + g.height * g.resolution}};
  for (std::size_t k = 0; k < std::size(kLayers); ++k) {
    write_float_tiff(
        folder / (std::string(kLayers[k]) + ".tiff"), g.width, g.height,
        [&](int y, float* row) { layer_row(grid, g, y, layer_of(k), row); }, place);
  }
  write_atomically(folder / "grid.yaml",
                   fmt::format("resolution: {}\norigin: [{}, {}, 0]\nwidth: {}\nheight: {}\n"
                               "layers: [height, slope, navigability, confidence]\n",
                               g.resolution, origin.x(), origin.y(), g.width, g.height));
}

WrittenGrid read_grid(const std::filesystem::path& folder) {
  WrittenGrid written{read_geometry(folder / "grid.yaml"), NavigabilityGrid{}};
  const GridGeometry& g = written.geometry;
  written.grid = NavigabilityGrid(g.resolution);
  // Navigability and height first: they make the cells, the others know these.
  for (const std::size_t k : {std::size_t{2}, std::size_t{0}, std::size_t{1}, std::size_t{3}}) {
    const bool makes = k == 2 || k == 0;
    read_float_tiff(folder / (std::string(kLayers[k]) + ".tiff"), g.width, g.height,
                    [&](int y, const float* row) {
                      const std::int32_t j = g.first.j + g.height - 1 - y;
                      for (std::int32_t i = 0; i < g.width; ++i) {
                        if (std::isnan(row[i])) continue;
                        const CellIndex c{g.first.i + i, j};
                        if (makes) {
                          written.grid.at_or_new(c).*layer_of(k) = row[i];
                        } else if (NavigabilityCell* cell = written.grid.find(c)) {
                          cell->*layer_of(k) = row[i];
                        }
                      }
                    });
  }
  return written;
}

NavigabilityGrid read_map_grid(const std::filesystem::path& map) {
  if (!std::filesystem::exists(map / "grid" / "grid.yaml")) require_map_folder(map);
  return read_grid(map / "grid").grid;
}

void write_navigability_map(const std::filesystem::path& folder, const NavigabilityGrid& grid) {
  // Grey between the two thresholds where nothing is known: map_server of ROS 1 reads alpha only of
  // what neither of them decides.
  constexpr std::uint8_t kUnknownGrey = 128;
  const GridGeometry g = at_least_one_cell(known_bounds(grid));
  std::vector<float> values(static_cast<std::size_t>(g.width));
  write_png(folder / "map.png", g.width, g.height, 4, [&](int y, std::uint8_t* row) {
    layer_row(grid, g, y, &NavigabilityCell::navigability, values.data());
    for (const float value : values) {
      const bool known = !std::isnan(value);
      const auto grey =
          known ? static_cast<std::uint8_t>(std::lround(255.0F * value)) : kUnknownGrey;
      row = std::fill_n(row, 3, grey);
      *row++ = known ? 255 : 0;
    }
  });
  write_atomically(folder / "map.yaml", map_yaml(g, "map.png", "scale"));
}

void write_occupancy_map(const std::filesystem::path& folder, const GridGeometry& geometry,
                         const std::function<void(int row, float* values)>& fill) {
  const GridGeometry g = at_least_one_cell(geometry);
  std::vector<float> values(static_cast<std::size_t>(g.width),
                            std::numeric_limits<float>::quiet_NaN());
  write_pgm_map(folder, "occupancy", "trinary", g, [&](int y, std::string& pixels) {
    if (!geometry.empty()) fill(y, values.data());
    std::transform(values.begin(), values.end(), pixels.begin(), [](float p) {
      constexpr std::uint8_t kOccupied = 0, kUnknown = 205, kFree = 254;
      return static_cast<char>(p > 0.65F ? kOccupied : p < 0.196F ? kFree : kUnknown);
    });
  });
}

void write_filter_masks(const std::filesystem::path& folder, const NavigabilityGrid& grid) {
  const GridGeometry g = at_least_one_cell(known_bounds(grid));
  std::vector<float> values(static_cast<std::size_t>(g.width));
  const auto write = [&](const std::string& name, char (*mask)(float navigability)) {
    write_pgm_map(folder, name, "raw", g, [&](int y, std::string& pixels) {
      layer_row(grid, g, y, &NavigabilityCell::navigability, values.data());
      std::transform(values.begin(), values.end(), pixels.begin(), mask);
    });
  };
  write("keepout", [](float n) { return static_cast<char>(n == 0 ? 100 : 0); });
  write("speed", [](float n) {
    return static_cast<char>(n > 0 && n < 1 ? std::clamp(std::lround(100 * n), 1L, 99L) : 0);
  });
}

}  // namespace lamina::io
