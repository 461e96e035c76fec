// Small readers of PLY and OBJ.
#include <lamina/sim/mesh_file.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include <lamina/models/error.hpp>

namespace lamina::sim {
namespace {

void add_fan(Mesh& mesh, const std::vector<std::int64_t>& corners, const std::string& name,
             const std::string& place) {
  const auto count = static_cast<std::int64_t>(mesh.vertices_map.size());
  for (std::int64_t corner : corners) {
    if (corner < 0 || corner >= count) {
      throw input_error(name, place, "vertex " + std::to_string(corner),
                        "one of the file's " + std::to_string(count) + " vertices");
    }
  }
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    mesh.triangles.emplace_back(static_cast<int>(corners[0]), static_cast<int>(corners[k]),
                                static_cast<int>(corners[k + 1]));
  }
}

struct Property {
  std::string name, type, count_type;  ///< count_type: of lists
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};

struct PlyHeader {
  bool ascii = true, big_endian = false;
  std::vector<Element> elements;
  std::size_t body = 0;
};

std::size_t size_of(const std::string& type, const std::string& name) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "int32" || type == "uint32") return 4;
  if (type == "float" || type == "float32") return 4;
  if (type == "double" || type == "float64") return 8;
  throw input_error(name, "header", "type \"" + type + '"', "a type of the PLY format");
}

/// Entries without a property take no bytes: a short file could promise any number of them.
void check_elements(const PlyHeader& header, const std::string& name) {
  for (const Element& element : header.elements) {
    if (element.count > 0 && element.properties.empty()) {
      throw input_error(name, "header", "element " + element.name + " without a property",
                        "a property of each element");
    }
  }
}

Element read_element(std::istringstream& line, const std::string& name, int line_number) {
  Element element;
  if (!(line >> element.name >> element.count) || element.count < 0 || element.count > 1000000000) {
    throw input_error(name, std::to_string(line_number), "a broken element", "name and count");
  }
  return element;
}

Property read_property(std::istringstream& line, const std::string& name) {
  Property property;
  line >> property.type;
  if (property.type == "list") {
    line >> property.count_type >> property.type;
    size_of(property.count_type, name);
  }
  line >> property.name;
  size_of(property.type, name);
  return property;
}

PlyHeader read_header(const std::string& bytes, const std::string& name) {
  PlyHeader header;
  std::size_t at = 0;
  for (int line_number = 1;; ++line_number) {
    const std::size_t end = bytes.find('\n', at);
    if (end == std::string::npos) {
      throw input_error(name, "header", "the end of the file", "end_header");
    }
    std::istringstream line(bytes.substr(at, end - at));
    at = end + 1;
    std::string word;
    line >> word;
    if (line_number == 1 && word != "ply") {
      throw input_error(name, "1", '"' + word + '"', "ply");
    }
    if (word == "format") {
      std::string format;
      line >> format;
      header.ascii = format == "ascii";
      header.big_endian = format == "binary_big_endian";
    } else if (word == "element") {
      header.elements.push_back(read_element(line, name, line_number));
    } else if (word == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(read_property(line, name));
    } else if (word == "end_header") {
      check_elements(header, name);
      header.body = at;
      return header;
    }
  }
}

/// Numbers one after the other, from text or from bytes.
class PlyBody {
 public:
  PlyBody(const std::string& bytes, const PlyHeader& header, const std::string& name)
      : bytes_(bytes), header_(header), name_(name), at_(header.body) {}

  double next(const std::string& type) { return header_.ascii ? next_word() : next_binary(type); }
  std::string place() const { return "byte " + std::to_string(at_); }

 private:
  [[noreturn]] void ended() const {
    throw input_error(name_, place(), "the end of the file", "what the header promises");
  }
  double next_word() {
    while (at_ < bytes_.size() && std::isspace(static_cast<unsigned char>(bytes_[at_])) != 0) ++at_;
    if (at_ >= bytes_.size()) ended();
    char* end = nullptr;
    const double value = std::strtod(bytes_.c_str() + at_, &end);
    if (end == bytes_.c_str() + at_) {
      throw input_error(name_, place(), "no number", "a number");
    }
    at_ = static_cast<std::size_t>(end - bytes_.c_str());
    return value;
  }
  template <class T>
  double as(const char* raw) const {
    T value;
    std::memcpy(&value, raw, sizeof value);
    return static_cast<double>(value);
  }
  double next_binary(const std::string& type) {
    const std::size_t size = size_of(type, name_);
    if (size > bytes_.size() - at_) ended();
    char raw[8];
    std::memcpy(raw, bytes_.data() + at_, size);
    at_ += size;
    if (header_.big_endian) std::reverse(raw, raw + size);
    const bool is_unsigned = type[0] == 'u';
    if (type[0] == 'f' || type[0] == 'd') return size == 8 ? as<double>(raw) : as<float>(raw);
    if (size == 1) return is_unsigned ? as<std::uint8_t>(raw) : as<std::int8_t>(raw);
    if (size == 2) return is_unsigned ? as<std::uint16_t>(raw) : as<std::int16_t>(raw);
    return is_unsigned ? as<std::uint32_t>(raw) : as<std::int32_t>(raw);
  }

  const std::string& bytes_;
  const PlyHeader& header_;
  const std::string& name_;
  std::size_t at_;
};

std::int64_t obj_index(const std::string& word, std::size_t vertices, const std::string& name,
                       const std::string& place) {
  char* end = nullptr;
  const long long value = std::strtoll(word.c_str(), &end, 10);
  if (end == word.c_str() || value == 0) {
    throw input_error(name, place, '"' + word + '"', "a vertex number");
  }
  return value > 0 ? value - 1 : static_cast<std::int64_t>(vertices) + value;
}

}  // namespace

Mesh parse_ply(const std::string& bytes, const std::string& name) {
  const PlyHeader header = read_header(bytes, name);
  PlyBody body(bytes, header, name);
  Mesh mesh;
  for (const Element& element : header.elements) {
    for (std::int64_t i = 0; i < element.count; ++i) {
      Eigen::Vector3f vertex = Eigen::Vector3f::Zero();
      for (const Property& property : element.properties) {
        if (property.count_type.empty()) {
          const double value = body.next(property.type);
          const std::size_t axis = std::string("xyz").find(property.name);
          if (property.name.size() == 1 && axis < 3) {
            vertex[static_cast<Eigen::Index>(axis)] = static_cast<float>(value);
          }
          continue;
        }
        const double count = body.next(property.count_type);
        std::vector<std::int64_t> corners;
        for (double k = 0; k < count; ++k) {
          // What is no index becomes one that no vertex has.
          const double corner = body.next(property.type);
          corners.push_back(std::abs(corner) < 1e15 ? static_cast<std::int64_t>(corner) : -1);
        }
        if (element.name == "face" &&
            (property.name == "vertex_indices" || property.name == "vertex_index")) {
          add_fan(mesh, corners, name, body.place());
        }
      }
      if (element.name == "vertex") {
        mesh.vertices_map.push_back(vertex);
      }
    }
  }
  return mesh;
}

Mesh parse_obj(const std::string& bytes, const std::string& name) {
  Mesh mesh;
  std::istringstream in(bytes);
  std::string text;
  for (int line_number = 1; std::getline(in, text); ++line_number) {
    std::istringstream line(text);
    std::string word;
    line >> word;
    const std::string place = std::to_string(line_number);
    if (word == "v") {
      Eigen::Vector3f v;
      if (!(line >> v.x() >> v.y() >> v.z())) {
        throw input_error(name, place, '"' + text + '"', "v x y z");
      }
      mesh.vertices_map.push_back(v);
    } else if (word == "f") {
      std::vector<std::int64_t> corners;
      while (line >> word) {
        corners.push_back(obj_index(word, mesh.vertices_map.size(), name, place));
      }
      if (corners.size() < 3) {
        throw input_error(name, place, '"' + text + '"', "f with three corners or more");
      }
      add_fan(mesh, corners, name, place);
    }
  }
  return mesh;
}

Mesh read_mesh(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  if (!in) {
    throw input_error(file.string(), "", "no readable file", "a .ply or .obj file");
  }
  const std::string extension = file.extension().string();
  if (extension != ".ply" && extension != ".obj") {
    throw input_error(file.string(), "", '"' + extension + '"', ".ply or .obj");
  }
  Mesh mesh = extension == ".ply" ? parse_ply(bytes.str(), file.string())
                                  : parse_obj(bytes.str(), file.string());
  mesh.name = file.stem().string();
  if (mesh.triangles.empty()) {
    throw input_error(file.string(), "", "no triangles", "a mesh with faces");
  }
  return mesh;
}

Mesh triangulate(const Scene& scene) {
  Mesh mesh;
  for (const Face& face : scene.faces()) {
    const int first = static_cast<int>(mesh.vertices_map.size());
    for (const Eigen::Vector3d& corner : face.corners_map) {
      mesh.vertices_map.push_back(corner.cast<float>());
    }
    for (int k = 1; k + 1 < static_cast<int>(face.corners_map.size()); ++k) {
      mesh.triangles.emplace_back(first, first + k, first + k + 1);
    }
  }
  return mesh;
}

}  // namespace lamina::sim
