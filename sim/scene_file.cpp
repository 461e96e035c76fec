// Scene files: a YAML description of ground, walls, boxes, ramps, houses, meshes, path and
// settings.
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <lamina/models/error.hpp>
#include <lamina/sim/mesh_file.hpp>
#include <lamina/sim/settings.hpp>
#include <lamina/sim/truth.hpp>
#include <lamina/sim/world.hpp>

namespace lamina::sim {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

/// One mapping of the file, with exact messages.
class Item {
 public:
  Item(const YAML::Node& node, std::string file, std::string path)
      : node_(node), file_(std::move(file)), path_(std::move(path)) {
    if (!node.IsMap()) {
      fail(node, "no mapping", "keys with values");
    }
  }
  void check_keys(const std::vector<std::string>& known) const {
    for (const auto& pair : node_) {
      const std::string key = pair.first.as<std::string>();
      if (std::find(known.begin(), known.end(), key) == known.end()) {
        const std::string hint = nearest_name(key, known);
        std::string all;
        for (const std::string& name : known) all += (all.empty() ? "" : ", ") + name;
        fail(pair.first, "unknown key \"" + key + '"',
             hint.empty() ? "one of " + all : "a known one: did you mean '" + hint + "'?");
      }
    }
  }
  bool has(const std::string& key) const { return static_cast<bool>(node_[key]); }
  double number(const std::string& key, double fallback) const {
    return has(key) ? value<double>(key, "a number") : fallback;
  }
  double number(const std::string& key) const { return value<double>(need(key), "a number"); }
  std::string text(const std::string& key, const std::string& fallback) const {
    return has(key) ? value<std::string>(key, "a word") : fallback;
  }
  std::vector<double> numbers(const std::string& key, std::size_t count) const {
    const auto v =
        value<std::vector<double>>(need(key), "a list of " + std::to_string(count) + " numbers");
    if (v.size() != count) {
      fail(node_[key], std::to_string(v.size()) + " numbers", std::to_string(count));
    }
    return v;
  }
  Eigen::Vector3d vector(const std::string& key) const {
    const auto v = numbers(key, 3);
    return {v[0], v[1], v[2]};
  }
  Eigen::Vector3d vector(const std::string& key, const Eigen::Vector3d& fallback) const {
    return has(key) ? vector(key) : fallback;
  }
  std::vector<Eigen::Vector3d> vectors(const std::string& key) const {
    std::vector<Eigen::Vector3d> out;
    for (const auto& v : value<std::vector<std::vector<double>>>(need(key), "a list of points")) {
      if (v.size() != 2 && v.size() != 3) {
        fail(node_[key], std::to_string(v.size()) + " numbers", "[x, y] or [x, y, z]");
      }
      out.emplace_back(v[0], v[1], v.size() == 3 ? v[2] : 0.0);
    }
    return out;
  }
  PlaneLabel label(const std::string& key, PlaneLabel fallback) const {
    const std::string word = text(key, to_string(fallback));
    const auto found = label_from(word);
    if (!found) {
      fail(node_[key], '"' + word + '"', "floor, ramp, step, wall, ceiling or other");
    }
    return *found;
  }
  SE3 pose() const {
    return SE3(SO3::rot_z(number("yaw_deg", 0) * kDegree), vector("at", Eigen::Vector3d::Zero()));
  }
  /// The mappings of a list, each named after its key and place.
  std::vector<Item> list(const std::string& key) const {
    std::vector<Item> out;
    if (has(key)) {
      if (!node_[key].IsSequence()) {
        fail(node_[key], "no list", "a list of mappings");
      }
      for (const auto& node : node_[key]) {
        out.emplace_back(node, file_, key + "[" + std::to_string(out.size()) + "]");
      }
    }
    return out;
  }
  std::string name(const std::string& kind, std::size_t index) const {
    return text("name", kind + std::to_string(index));
  }
  Item section(const std::string& key) const { return Item(node_[key], file_, key); }
  Parameters parameters() const {
    Parameters out;
    for (const auto& pair : node_) {
      out[pair.first.as<std::string>()] = pair.second.as<std::string>();
    }
    return out;
  }
  [[noreturn]] void fail(const YAML::Node& at, const std::string& found,
                         const std::string& expected) const {
    throw input_error(file_,
                      std::to_string(at.Mark().line + 1) + (path_.empty() ? "" : ": " + path_),
                      found, expected);
  }

 private:
  const std::string& need(const std::string& key) const {
    if (!has(key)) {
      fail(node_, "no key " + key, key);
    }
    return key;
  }
  template <class T>
  T value(const std::string& key, const std::string& expected) const {
    try {
      return node_[key].as<T>();
    } catch (const YAML::Exception&) {
      fail(node_[key], "another value for " + key, expected);
    }
  }

  YAML::Node node_;
  std::string file_, path_;
};

std::vector<Rect> rectangles(const Item& item, const std::string& key) {
  std::vector<Rect> out;
  for (const Item& r : item.list(key)) {
    r.check_keys({"area"});
    const auto v = r.numbers("area", 4);
    out.push_back({v[0], v[1], v[2], v[3]});
  }
  return out;
}

void add_surfaces(const Item& root, Scene& scene) {
  std::size_t n = 0;
  for (const Item& item : root.list("ground")) {
    item.check_keys({"name", "area", "z", "label", "openings", "slab_m"});
    const auto a = item.numbers("area", 4);
    const std::string name = item.name("ground", n++);
    const double z = item.number("z", 0), slab = item.number("slab_m", 0.2);
    const std::vector<Rect> openings = rectangles(item, "openings");
    scene.add_ground(name, item.label("label", PlaneLabel::kFloor), {a[0], a[1], a[2], a[3]}, z,
                     openings);
    for (std::size_t k = 0; k < openings.size(); ++k) {
      scene.add_hole_walls(name + ".opening" + std::to_string(k), openings[k], z, slab);
    }
  }
  for (const Item& item : root.list("walls")) {
    item.check_keys({"name", "from", "to", "z"});
    const auto a = item.numbers("from", 2), b = item.numbers("to", 2);
    const auto z = item.has("z") ? item.numbers("z", 2) : std::vector<double>{0, 2.5};
    scene.add_wall(item.name("wall", n++), {a[0], a[1]}, {b[0], b[1]}, z[0], z[1]);
  }
  for (const Item& item : root.list("polygons")) {
    item.check_keys({"name", "label", "corners"});
    scene.add_polygon(item.name("polygon", n++), item.label("label", PlaneLabel::kOther),
                      item.vectors("corners"));
  }
}

void add_bodies(const Item& root, Scene& scene, const std::filesystem::path& folder) {
  std::size_t n = 0;
  for (const Item& item : root.list("boxes")) {
    item.check_keys({"name", "at", "yaw_deg", "size", "top", "sides"});
    scene.add_box(item.name("box", n++), item.pose(), item.vector("size"),
                  item.label("top", PlaneLabel::kOther), item.label("sides", PlaneLabel::kOther));
  }
  for (const Item& item : root.list("ramps")) {
    item.check_keys({"name", "at", "yaw_deg", "length", "width", "rise"});
    scene.add_ramp(item.name("ramp", n++), item.pose(), item.number("length"), item.number("width"),
                   item.number("rise"));
  }
  for (const Item& item : root.list("houses")) {
    item.check_keys({"name", "at", "yaw_deg", "length", "width", "eaves", "pitch_deg"});
    const auto at = item.has("at") ? item.numbers("at", 2) : std::vector<double>{0, 0};
    const House usual;
    scene.add_house(item.name("house", n++),
                    {at[0], at[1], item.number("yaw_deg", 0), item.number("length", usual.length),
                     item.number("width", usual.width), item.number("eaves", usual.eaves),
                     item.number("pitch_deg", usual.pitch_deg)});
  }
  for (const Item& item : root.list("cylinders")) {
    item.check_keys({"name", "base", "axis", "radius", "length"});
    scene.add_cylinder({item.name("cylinder", n++), item.vector("base"),
                        item.vector("axis", Eigen::Vector3d::UnitZ()).normalized(),
                        item.number("radius"), item.number("length")});
  }
  for (const Item& item : root.list("meshes")) {
    item.check_keys({"name", "file", "at", "yaw_deg", "scale"});
    Mesh mesh = read_mesh(folder / item.text("file", ""));
    const SE3 T_map_mesh = item.pose();
    const double scale = item.number("scale", 1);
    for (Eigen::Vector3f& v : mesh.vertices_map) {
      v = (T_map_mesh * Eigen::Vector3d(scale * v.cast<double>())).cast<float>();
    }
    scene.add_mesh(std::move(mesh));
  }
}

Path make_path(const Item& root) {
  if (!root.has("path")) {
    return Path::stay(SE3(), 3);
  }
  const Item item = root.section("path");
  item.check_keys({"points", "speed", "turn_rate", "at", "yaw_deg", "stay_s", "sway"});
  Sway sway;
  if (item.has("sway")) {
    const Item s = item.section("sway");
    s.check_keys({"roll_deg", "pitch_deg", "yaw_deg", "height_m", "period_s"});
    sway = {s.number("roll_deg", 0) * kDegree, s.number("pitch_deg", 0) * kDegree,
            s.number("yaw_deg", 0) * kDegree, s.number("height_m", 0), s.number("period_s", 4)};
  }
  if (!item.has("points")) {
    return Path::stay(item.pose(), item.number("stay_s", 3));
  }
  return Path::drive(item.vectors("points"), item.number("speed", 0.5),
                     item.number("turn_rate", 0.8), sway);
}

World read_scene(const std::filesystem::path& file, const Parameters& overrides) {
  YAML::Node node;
  if (!std::ifstream(file)) {
    throw input_error(file.string(), "", "no readable file", "a scene in YAML");
  }
  try {
    node = YAML::LoadFile(file.string());
  } catch (const YAML::Exception& error) {
    throw input_error(file.string(), std::to_string(error.mark.line + 1), error.msg, "valid YAML");
  }
  const Item root(node, file.string(), "");
  root.check_keys({"name", "description", "robot_height", "ground", "walls", "polygons", "boxes",
                   "ramps", "houses", "cylinders", "meshes", "path", "settings"});
  World world;
  world.name = root.text("name", file.stem().string());
  world.description = root.text("description", "");
  world.robot_height = root.number("robot_height", world.robot_height);
  add_surfaces(root, world.scene);
  add_bodies(root, world.scene, file.parent_path());
  if (world.scene.faces().empty() && world.scene.meshes().empty()) {
    root.fail(node, "nothing to see", "ground, walls, boxes or meshes");
  }
  world.path = make_path(root);
  Parameters parameters =
      root.has("settings") ? root.section("settings").parameters() : Parameters();
  for (const auto& [key, value] : overrides) {
    parameters[key] = value;
  }
  Settings settings(file.string(), parameters);
  world.rig = make_rig(settings, {});
  settings.finish();
  return world;
}

}  // namespace

World load_scene(const std::string& scene, const Parameters& parameters) {
  const std::filesystem::path path(scene);
  const std::string extension = path.extension().string();
  return extension == ".yaml" || extension == ".yml" ? read_scene(path, parameters)
                                                     : make_scene(scene, parameters);
}

}  // namespace lamina::sim
