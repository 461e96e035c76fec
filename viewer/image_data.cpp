// Grids, occupancy and surfels as the page's JSON.
#include <lamina/viewer/image_data.hpp>

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include <lamina/io/grid_files.hpp>
#include <lamina/models/error.hpp>
#include <lamina/viewer/encode.hpp>
#include <lamina/viewer/parts.hpp>

namespace lamina::viewer {
namespace {

using Json = nlohmann::ordered_json;
using Path = std::filesystem::path;

struct Frame {
  double resolution = 0, x = 0, y = 0;  ///< cell size and lower left corner, m
  int width = 0, height = 0;
  int coarser = 0;  ///< rows and columns skipped beyond what the number of cells asks for
  int step() const {
    const double cells = static_cast<double>(width) * static_cast<double>(height);
    const double least = std::ceil(std::sqrt(cells / static_cast<double>(kMostCells)));
    return std::max(1, static_cast<int>(least)) + coarser;
  }
  Json json() const {
    const int s = step();
    const int rows = (height + s - 1) / s;
    Json out;
    out["resolution"] = resolution * s;
    // Row 0 is the top one: what thinning adds hangs over at the bottom.
    out["origin"] = {x, y + (height - rows * s) * resolution};
    out["width"] = (width + s - 1) / s;
    out["height"] = rows;
    out["step"] = s;
    return out;
  }
  /// Of every step()th row and column what `at(row, column)` gives; rows count from the top.
  template <typename T, typename At>
  std::vector<T> thinned(const At& at) const {
    const int s = step();
    std::vector<T> out;
    for (int row = 0; row < height; row += s) {
      for (int i = 0; i < width; i += s) out.push_back(at(row, i));
    }
    return out;
  }
};

/// The frame with its layers, as coarse as it takes to stay within `most` bytes.
template <typename AddLayers>
std::string fitted(Frame& frame, std::size_t most, AddLayers&& add) {
  for (;; ++frame.coarser) {
    Json out = frame.json();
    add(out);
    std::string text = out.dump();
    if (text.size() <= most || frame.step() >= std::max(frame.width, frame.height)) return text;
  }
}

std::string text_of(const Path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw Error(file.string() + ": cannot be opened");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Where the numbers of the disc stand within a vertex, bytes; floats or doubles.
struct PlyHeader {
  struct Column {
    std::size_t at = 0, size = 0;
  };
  std::size_t vertices = 0, bytes = 0, data = 0;  ///< bytes: of a vertex
  std::array<Column, 7> column{};
};
constexpr std::array<const char*, 7> kColumns = {"x", "y", "z", "nx", "ny", "nz", "radius"};

PlyHeader read_header(const Path& file, const std::string& content) {
  PlyHeader header;
  unsigned found = 0;
  std::size_t at = 0;
  std::string line;
  for (int number = 1; line != "end_header"; ++number) {
    const std::size_t end = content.find('\n', at);
    if (end == std::string::npos) throw Error(file.string() + ": found no end_header");
    line = content.substr(at, end - at);
    at = end + 1;
    std::istringstream words(line);
    std::string kind, type, name;
    words >> kind >> type >> name;
    if (kind == "format" && type != "binary_little_endian") {
      throw Error(file.string() + ": found format " + type + ", expected binary_little_endian");
    }
    if (kind == "element" && type == "vertex") {
      if (!(std::istringstream(name) >> header.vertices)) {
        throw input_error(file.string(), std::to_string(number), "'" + line + "'", "a count");
      }
    }
    if (kind != "property") continue;
    const std::size_t size = type == "float" ? 4 : type == "double" ? 8 : 0;
    if (size == 0) throw Error(file.string() + ": found a " + type + ", expected float or double");
    for (std::size_t k = 0; k < kColumns.size(); ++k) {
      if (name == kColumns[k]) {
        header.column[k] = {header.bytes, size};
        found |= 1U << k;
      }
    }
    header.bytes += size;
  }
  header.data = at;
  if (found != (1U << kColumns.size()) - 1) {
    throw Error(file.string() + ": expected columns x y z nx ny nz radius");
  }
  return header;
}

double number_at(const std::string& content, std::size_t at, std::size_t size) {
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < size; ++k) {
    bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(content[at + k])) << (8 * k);
  }
  if (size == 8) return std::bit_cast<double>(bits);
  return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
}

}  // namespace

std::string grid_data(const Path& folder) {
  try {
    const YAML::Node yaml = YAML::LoadFile((folder / "grid.yaml").string());
    if (yaml["width"].as<int>() <= 0 || yaml["height"].as<int>() <= 0) return {};
  } catch (const YAML::Exception& e) {
    throw Error((folder / "grid.yaml").string() + ": " + e.what() +
                ", expected grid.yaml of a map");
  }
  const io::WrittenGrid written = io::read_grid(folder);
  const GridGeometry& g = written.geometry;
  Frame frame{g.resolution, g.origin().x(), g.origin().y(), g.width, g.height};
  constexpr std::pair<const char*, float NavigabilityCell::*> kLayers[] = {
      {"navigability", &NavigabilityCell::navigability},
      {"height", &NavigabilityCell::height},
      {"slope", &NavigabilityCell::slope},
      {"confidence", &NavigabilityCell::confidence}};
  return fitted(frame, kMostGridText, [&](Json& out) {
    for (const auto& [name, member] : kLayers) {
      const auto value = [&, layer = member](int row, int i) {
        const NavigabilityCell* cell =
            written.grid.find({g.first.i + i, g.first.j + g.height - 1 - row});
        return cell == nullptr ? NavigabilityCell::kUnknown : cell->*layer;
      };
      const Quantised q = quantise(frame.thinned<float>(value));
      Json layer;
      layer["least"] = q.least;
      layer["largest"] = q.largest;
      layer["codes"] = base64(run_lengths(q.codes));
      out["layers"][name] = std::move(layer);
    }
  });
}

namespace {

// Sets the frame's size; where the pixels begin, all of which are there.
std::size_t read_pgm_header(std::ifstream& in, const Path& file, Frame& frame) {
  std::string magic;
  int largest = 0;
  in >> magic >> frame.width >> frame.height >> largest;
  if (!in || magic != "P5" || largest != 255 || frame.width < 0 || frame.height < 0) {
    throw Error(file.string() + ": expected a binary PGM (P5) of 8 bits");
  }
  const auto cells = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  // One blank after the header; at the file's end there is no position, and no pixels.
  const std::streamoff end = in.eof() ? -1 : static_cast<std::streamoff>(in.tellg());
  const std::size_t size = std::filesystem::file_size(file);
  const std::size_t start = end < 0 ? size : static_cast<std::size_t>(end) + 1;
  if (size < start + cells) {
    throw input_error(file.string(), "", std::to_string(size - std::min(size, start)) + " pixels",
                      std::to_string(cells));
  }
  return start;
}

}  // namespace

std::string occupancy_data(const Path& file) {
  Frame frame;
  const Path yaml_file = file.parent_path() / "occupancy.yaml";
  try {
    const YAML::Node yaml = YAML::LoadFile(yaml_file.string());
    frame.resolution = yaml["resolution"].as<double>();
    frame.x = yaml["origin"][0].as<double>();
    frame.y = yaml["origin"][1].as<double>();
  } catch (const YAML::Exception& e) {
    throw Error(yaml_file.string() + ": " + e.what() + ", expected resolution and origin");
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) throw Error(file.string() + ": cannot be opened");
  const std::size_t start = read_pgm_header(in, file, frame);
  std::string pixels(static_cast<std::size_t>(frame.width), '\0');
  const auto value = [&](int row, int i) {
    if (i == 0) {
      in.seekg(static_cast<std::streamoff>(start) + std::streamoff{row} * frame.width);
      in.read(pixels.data(), frame.width);
    }
    return static_cast<std::uint8_t>(pixels[static_cast<std::size_t>(i)]);
  };
  return fitted(frame, kMostOccupancyText, [&](Json& out) {
    out["layers"]["occupancy"] = {
        {"least", 0},
        {"largest", 255},
        {"codes", base64(run_lengths(frame.thinned<std::uint8_t>(value)))}};
  });
}

std::string surfel_data(const Path& file) {
  const std::string content = text_of(file);
  const PlyHeader header = read_header(file, content);
  const std::size_t bytes = header.bytes;
  if ((content.size() - header.data) / bytes < header.vertices) {
    throw input_error(file.string(), "",
                      std::to_string((content.size() - header.data) / bytes) + " vertices",
                      std::to_string(header.vertices));
  }
  const std::size_t stride = thinning_stride(header.vertices, kMostSurfels);
  std::vector<Surfel> surfels;
  for (std::size_t i = 0; i < header.vertices; i += stride) {
    const auto value = [&](std::size_t column) {
      const auto [at, size] = header.column[column];
      return number_at(content, header.data + i * bytes + at, size);
    };
    Surfel& surfel = surfels.emplace_back();
    surfel.center = {value(0), value(1), value(2)};
    surfel.normal = {value(3), value(4), value(5)};
    surfel.radius = value(6);
  }
  return surfels_text(surfels, header.vertices);
}

}  // namespace lamina::viewer
