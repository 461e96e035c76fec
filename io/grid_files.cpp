// Grids as images and YAML.
#include <lamina/io/grid_files.hpp>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/image_files.hpp>
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

// An empty map is still a file that readers accept: one unknown cell.
GridGeometry at_least_one_cell(GridGeometry g) {
  if (g.empty()) g.width = g.height = 1;
  return g;
}

}  // namespace

void write_grid(const std::filesystem::path& folder, const NavigabilityGrid& grid) {
  const GridGeometry g = at_least_one_cell(known_bounds(grid));
  make_output_folder(folder);
  for (std::size_t k = 0; k < std::size(kLayers); ++k) {
    write_float_tiff(folder / (std::string(kLayers[k]) + ".tiff"), g.width, g.height,
                     layer_image(grid, g, layer_of(k)));
  }
  const Eigen::Vector2d origin = g.origin();
  write_atomically(folder / "grid.yaml",
                   fmt::format("resolution: {}\norigin: [{}, {}, 0]\nwidth: {}\nheight: {}\n"
                               "layers: [height, slope, navigability, confidence]\n",
                               g.resolution, origin.x(), origin.y(), g.width, g.height));
}

GridImages read_grid(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "grid.yaml";
  GridImages images;
  if (!std::filesystem::is_regular_file(file)) {
    throw Error(file.string() + ": found no such file, expected grid.yaml of a map");
  }
  try {
    const YAML::Node yaml = YAML::LoadFile(file.string());
    GridGeometry& g = images.geometry;
    g.resolution = yaml["resolution"].as<double>();
    g.width = yaml["width"].as<int>();
    g.height = yaml["height"].as<int>();
    if (!(g.resolution > 0) || g.empty()) {
      throw Error(file.string() + ": found an empty grid, expected resolution, width, height > 0");
    }
    g.first = {
        static_cast<std::int32_t>(std::lround(yaml["origin"][0].as<double>() / g.resolution)),
        static_cast<std::int32_t>(std::lround(yaml["origin"][1].as<double>() / g.resolution))};
  } catch (const YAML::Exception& error) {
    throw Error(file.string() + ": " + error.what() + ", expected grid.yaml of a map");
  }
  std::vector<float>* layers[] = {&images.height, &images.slope, &images.navigability,
                                  &images.confidence};
  for (std::size_t k = 0; k < std::size(kLayers); ++k) {
    *layers[k] = read_float_tiff(folder / (std::string(kLayers[k]) + ".tiff"),
                                 images.geometry.width, images.geometry.height);
  }
  return images;
}

NavigabilityGrid to_grid(const GridImages& images) {
  NavigabilityGrid grid(images.geometry.resolution);
  const GridGeometry& g = images.geometry;
  for (int row = 0; row < g.height; ++row) {
    for (int i = 0; i < g.width; ++i) {
      const CellIndex c{g.first.i + i, g.first.j + row};
      const std::size_t k = g.image_index(c);
      if (std::isnan(images.navigability[k]) && std::isnan(images.height[k])) continue;
      grid.at_or_new(c) = {images.height[k], images.slope[k], images.navigability[k],
                           images.confidence[k]};
    }
  }
  return grid;
}

void write_navigability_map(const std::filesystem::path& folder, const NavigabilityGrid& grid) {
  const GridGeometry g = at_least_one_cell(known_bounds(grid));
  const std::vector<float> values = layer_image(grid, g, &NavigabilityCell::navigability);
  std::vector<std::uint8_t> pixels(2 * values.size(), 0);
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (std::isnan(values[k])) continue;
    pixels[2 * k] = static_cast<std::uint8_t>(std::lround(255.0f * values[k]));
    pixels[2 * k + 1] = 255;
  }
  write_png(folder / "map.png", g.width, g.height, 2, pixels);
  write_atomically(folder / "map.yaml", map_yaml(g, "map.png", "scale"));
}

void write_occupancy_map(const std::filesystem::path& folder, const GridGeometry& geometry,
                         const std::vector<float>& image) {
  const GridGeometry g = at_least_one_cell(geometry);
  std::string pixels(static_cast<std::size_t>(g.width) * static_cast<std::size_t>(g.height),
                     static_cast<char>(205));
  for (std::size_t k = 0; k < image.size(); ++k) {
    if (std::isnan(image[k])) continue;
    if (image[k] > 0.65f) {
      pixels[k] = static_cast<char>(0);
    } else if (image[k] < 0.196f) {
      pixels[k] = static_cast<char>(254);
    }
  }
  write_atomically(folder / "occupancy.pgm",
                   fmt::format("P5\n{} {}\n255\n", g.width, g.height) + pixels);
  write_atomically(folder / "occupancy.yaml", map_yaml(g, "occupancy.pgm", "trinary"));
}

}  // namespace lamina::io
