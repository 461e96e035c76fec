// Loading and saving settings through the table.
#include <lamina/pipeline/config/settings.hpp>

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include <lamina/models/error.hpp>
#include <lamina/pipeline/config/nearest.hpp>
#include <lamina/pipeline/config/setting_ranges.hpp>

namespace lamina {
namespace {

std::string text_of(const YAML::Node& node) {
  if (!node.IsSequence()) return node.Scalar();
  std::string text = "[";
  for (std::size_t i = 0; i < node.size(); ++i) text += (i ? ", " : "") + node[i].Scalar();
  return text + "]";
}

void load_node(MapOptions& settings, const YAML::Node& node, const std::string& prefix,
               const std::string& file) {
  std::set<std::string> seen;
  for (const auto& entry : node) {
    const std::string key = prefix + entry.first.Scalar();
    if (!seen.insert(key).second) {
      throw Error(file + ":" + std::to_string(entry.first.Mark().line + 1) + ": found the key '" +
                  key + "' a second time, expected each once");
    }
    if (entry.second.IsMap()) {
      load_node(settings, entry.second, key + ".", file);
    } else {
      set(settings, key, text_of(entry.second),
          file + ":" + std::to_string(entry.first.Mark().line + 1));
    }
  }
}

}  // namespace

namespace {

// Names of version 0.1, read until the next: by whole name, or all of a section.
std::string present_name(const std::string& key, const std::string& origin,
                         std::set<std::string>& lines) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kFormer{
      {{"wheels.images", "depth_odometry.enabled"},
       {"window.planes_behind", "window.dormant_planes"},
       {"scan.", "obstacles."},
       {"places.", "place_recognition."}}};
  for (const auto& [former, present] : kFormer) {
    if (key != former && !(former.back() == '.' && key.rfind(former, 0) == 0)) continue;
    const std::string name = std::string(present) + key.substr(former.size());
    lines.insert(origin + ": the setting '" + key + "' is called '" + name + "' now");
    return name;
  }
  return key;
}

}  // namespace

void set(MapOptions& settings, const std::string& given, const std::string& value,
         const std::string& origin) {
  const std::string key = present_name(given, origin, settings.former_names);
  std::vector<std::string> names;
  for (const Setting& setting : setting_table()) {
    if (setting.key == key) {
      try {
        require_in_range(key, value);
        setting.read(settings, value);
      } catch (const std::invalid_argument& expected) {
        throw Error(origin + ": " + key + ": found '" + value + "', expected " + expected.what());
      }
      return;
    }
    names.push_back(setting.key);
  }
  const std::string near = nearest(key, names);
  throw Error(origin + ": unknown key '" + key + "'" +
              (near.empty() ? ": `lamina config --defaults` lists all" : did_you_mean(near)));
}

void set_assignment(MapOptions& settings, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos) {
    throw Error("--set: found '" + assignment + "', expected key=value");
  }
  set(settings, assignment.substr(0, equals), assignment.substr(equals + 1), "--set");
}

void load_text(MapOptions& settings, const std::string& yaml, const std::string& name) {
  YAML::Node root;
  try {
    root = YAML::Load(yaml);
  } catch (const YAML::Exception& error) {
    throw Error(name + ":" + std::to_string(error.mark.line + 1) + ": " + error.msg +
                ", expected YAML");
  }
  if (root.IsNull()) return;
  if (!root.IsMap()) throw Error(name + ": found no keys, expected `key: value` lines");
  load_node(settings, root, "", name);
}

void load(MapOptions& settings, const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  if (std::filesystem::is_directory(file) || !(text << in.rdbuf())) {
    if (!std::filesystem::is_regular_file(file) || std::filesystem::file_size(file) > 0) {
      throw Error(file.string() + ": cannot be opened, expected a YAML file of settings");
    }
  }
  load_text(settings, text.str(), file.string());
}

std::string to_yaml(const MapOptions& settings, bool comments) {
  std::string out, section;
  for (const Setting& setting : setting_table()) {
    const auto dot = setting.key.find('.');
    std::string indent, name = setting.key;
    if (dot != std::string::npos) {
      if (setting.key.substr(0, dot) != section) {
        section = setting.key.substr(0, dot);
        out += section + ":\n";
      }
      indent = "  ";
      name = setting.key.substr(dot + 1);
    }
    if (comments) out += indent + "# " + setting.comment + "\n";
    out += indent + name + ": " + setting.write(settings) + "\n";
  }
  return out;
}

std::string to_markdown(const MapOptions& defaults) {
  std::string out =
      "# Settings\n\nGenerated by `lamina config --markdown` from the program's own table; give "
      "them by\n`--set key=value` or `--config FILE`.\n\n| key | default | meaning |\n"
      "|---|---|---|\n";
  for (const Setting& setting : setting_table()) {
    out +=
        "| `" + setting.key + "` | `" + setting.write(defaults) + "` | " + setting.comment + " |\n";
  }
  return out;
}

}  // namespace lamina
