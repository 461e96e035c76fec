// truth.yaml and its grids: written and read.
#include <lamina/sim/truth.hpp>

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <bit>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>

#include <lamina/models/error.hpp>

namespace lamina::sim {
namespace {

static_assert(std::endian::native == std::endian::little, "float maps are written little-endian");

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value == 0 ? 0.0 : value);  // never "-0"
  return text;
}

std::string vector_text(const Eigen::Vector3d& v) {
  return "[" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + "]";
}

std::string ring_text(const std::vector<Eigen::Vector3d>& ring) {
  std::string out = "[";
  for (std::size_t i = 0; i < ring.size(); ++i) {
    out += (i > 0 ? ", " : "") + vector_text(ring[i]);
  }
  return out + "]";
}

void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream out(file, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) {
    throw input_error(file.string(), "", "a file that cannot be written", "a writable folder");
  }
}

std::string float_map(const TruthGrid& grid, const std::vector<float>& layer) {
  std::string out =
      "Pf\n" + std::to_string(grid.width) + " " + std::to_string(grid.height) + "\n-1.0\n";
  const std::size_t head = out.size();
  out.resize(head + layer.size() * sizeof(float));
  std::memcpy(out.data() + head, layer.data(), layer.size() * sizeof(float));
  return out;
}

std::vector<float> read_float_map(const std::filesystem::path& file, int width, int height) {
  std::ifstream in(file, std::ios::binary);
  std::string kind;
  int w = 0, h = 0;
  double scale = 0;
  in >> kind >> w >> h >> scale;
  in.get();
  if (!in || kind != "Pf" || w != width || h != height || scale != -1.0) {
    throw input_error(
        file.string(), "", "another header",
        "a float map Pf of " + std::to_string(width) + " x " + std::to_string(height));
  }
  std::vector<float> layer(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  in.read(reinterpret_cast<char*>(layer.data()),
          static_cast<std::streamsize>(layer.size() * sizeof(float)));
  if (!in) {
    throw input_error(file.string(), "", "the end of the file", "a float for each cell");
  }
  return layer;
}

Eigen::Vector3d read_vector(const YAML::Node& node) {
  const auto v = node.as<std::vector<double>>();
  if (v.size() != 3) {
    throw YAML::RepresentationException(node.Mark(), "a list of 3 numbers is expected");
  }
  return {v[0], v[1], v[2]};
}

std::vector<Eigen::Vector3d> read_ring(const YAML::Node& node) {
  std::vector<Eigen::Vector3d> ring;
  for (const auto& corner : node) {
    ring.push_back(read_vector(corner));
  }
  return ring;
}

TruthPlane read_plane(const YAML::Node& node) {
  TruthPlane p;
  p.id = node["id"].as<std::int64_t>();
  p.name = node["name"].as<std::string>();
  const auto label = label_from(node["label"].as<std::string>());
  if (!label) {
    throw YAML::RepresentationException(node["label"].Mark(), "an unknown label");
  }
  p.label = *label;
  p.plane_map = Plane(read_vector(node["normal"]), node["rho"].as<double>());
  p.outline_map = read_ring(node["outline"]);
  for (const auto& ring : node["holes"]) {
    p.holes_map.push_back(read_ring(ring));
  }
  p.area = node["area"].as<double>();
  p.hits = node["hits"].as<std::int64_t>();
  p.sightings = node["sightings"].as<std::int64_t>();
  return p;
}

constexpr const char* kLayerFiles[3] = {"truth_height.pfm", "truth_navigability.pfm",
                                        "truth_reachable.pfm"};

}  // namespace

std::optional<PlaneLabel> label_from(const std::string& word) {
  for (PlaneLabel label : {PlaneLabel::kFloor, PlaneLabel::kRamp, PlaneLabel::kStep,
                           PlaneLabel::kWall, PlaneLabel::kCeiling, PlaneLabel::kOther}) {
    if (word == to_string(label)) {
      return label;
    }
  }
  return std::nullopt;
}

Truth truth_of(const Simulation& simulation, std::uint64_t seed) {
  Truth truth;
  truth.scene = simulation.world().name;
  truth.seed = seed;
  truth.hole_edges = simulation.world().scene.hole_edges();
  for (const ScenePlane& p : simulation.world().scene.planes()) {
    const std::size_t i = static_cast<std::size_t>(p.id);
    truth.planes.push_back({p.id, p.name, p.label, p.plane_map, p.outline_map, p.holes_map, p.area,
                            simulation.hits()[i], simulation.sightings()[i]});
  }
  return truth;
}

void write_truth(const Truth& truth, const std::filesystem::path& folder) {
  std::ostringstream out;
  out << "# What is true, in the frame of groundtruth.txt (m); see docs/simulator.md.\n"
      << "scene: " << truth.scene << "\nseed: " << truth.seed << "\nplanes:\n";
  for (const TruthPlane& p : truth.planes) {
    out << "  - {id: " << p.id << ", name: " << p.name << ", label: " << to_string(p.label)
        << ", normal: " << vector_text(p.plane_map.normal())
        << ", rho: " << number(p.plane_map.rho()) << ", area: " << number(p.area)
        << ", hits: " << p.hits << ", sightings: " << p.sightings
        << ",\n     outline: " << ring_text(p.outline_map) << ", holes: [";
    for (std::size_t i = 0; i < p.holes_map.size(); ++i) {
      out << (i > 0 ? ", " : "") << ring_text(p.holes_map[i]);
    }
    out << "]}\n";
  }
  out << (truth.hole_edges.empty() ? "hole_edges: []\n" : "hole_edges:\n");
  for (const HoleEdge& edge : truth.hole_edges) {
    out << "  - [" << vector_text(edge.from_map) << ", " << vector_text(edge.to_map) << "]\n";
  }
  const TruthGrid& g = truth.grid;
  if (g.width > 0) {
    out << "grid: {resolution: " << number(g.resolution) << ", origin: [" << number(g.x0) << ", "
        << number(g.y0) << "], width: " << g.width << ", height: " << g.height
        << ", layers: [height, navigability, reachable]}\n";
    write_file(folder / kLayerFiles[0], float_map(g, g.surface));
    write_file(folder / kLayerFiles[1], float_map(g, g.navigability));
    write_file(folder / kLayerFiles[2], float_map(g, g.reachable));
  }
  write_file(folder / "truth.yaml", out.str());
}

std::optional<Truth> read_truth(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "truth.yaml";
  if (!std::filesystem::exists(file)) {
    return std::nullopt;
  }
  Truth truth;
  try {
    const YAML::Node root = YAML::LoadFile(file.string());
    truth.scene = root["scene"].as<std::string>();
    truth.seed = root["seed"].as<std::uint64_t>();
    for (const auto& node : root["planes"]) {
      truth.planes.push_back(read_plane(node));
    }
    for (const auto& node : root["hole_edges"]) {
      truth.hole_edges.push_back({read_vector(node[0]), read_vector(node[1])});
    }
    if (const YAML::Node grid = root["grid"]) {
      TruthGrid& g = truth.grid;
      g.resolution = grid["resolution"].as<double>();
      g.x0 = grid["origin"][0].as<double>();
      g.y0 = grid["origin"][1].as<double>();
      g.width = grid["width"].as<int>();
      g.height = grid["height"].as<int>();
      if (g.width < 1 || g.height < 1 || g.width > 100000 || g.height > 100000) {
        throw YAML::RepresentationException(grid.Mark(), "an impossible grid size");
      }
    }
  } catch (const YAML::Exception& error) {
    throw input_error(file.string(), std::to_string(error.mark.line + 1), error.msg,
                      "truth as the simulator writes it");
  }
  TruthGrid& g = truth.grid;
  if (g.width > 0) {
    g.surface = read_float_map(folder / kLayerFiles[0], g.width, g.height);
    g.navigability = read_float_map(folder / kLayerFiles[1], g.width, g.height);
    g.reachable = read_float_map(folder / kLayerFiles[2], g.width, g.height);
  }
  return truth;
}

}  // namespace lamina::sim
