// Loading and saving settings through the table.
#include <lamina/apps/settings.hpp>

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include <lamina/apps/nearest.hpp>
#include <lamina/apps/setting_ranges.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {
namespace {

std::string text_of(const YAML::Node& node) {
  if (!node.IsSequence()) return node.Scalar();
  std::string text = "[";
  for (std::size_t i = 0; i < node.size(); ++i) text += (i ? ", " : "") + node[i].Scalar();
  return text + "]";
}

// Throws std::invalid_argument where a number, or one of several, is out of its range. What is no
// number at all, its own reader says.
void require_in_range(const std::string& key, const std::string& value) {
  const auto range = range_of(key);
  if (!range) return;
  std::stringstream numbers(value);
  for (std::string part; std::getline(numbers, part, ',');) {
    const auto first = part.find_first_not_of("[ \t"), last = part.find_last_not_of("] \t");
    double number = 0;
    try {
      text::read(first == std::string::npos ? "" : part.substr(first, last - first + 1), number);
    } catch (const std::invalid_argument&) {
      return;
    }
    if (number >= range->low && number <= range->high) continue;
    throw std::invalid_argument("a number from " + text::write(range->low) + " to " +
                                text::write(range->high));
  }
}

void load_node(Settings& settings, const YAML::Node& node, const std::string& prefix,
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

ScanOptions scan_options(const Settings& settings) {
  ScanOptions options = settings.scan;
  options.robot_height_m = settings.robot.height;
  options.max_step_m = settings.robot.max_step;
  // A ramp that is too steep for the robot is still no hole: it is judged in the grid.
  options.max_slope_deg = std::max(options.max_slope_deg, settings.robot.max_slope * 180 / M_PI);
  return options;
}

void set(Settings& settings, const std::string& key, const std::string& value,
         const std::string& origin) {
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
  throw Error(origin + ": found the unknown key '" + key + "', expected " +
              (near.empty() ? "a key of `lamina config --defaults`" : "'" + near + "'?"));
}

void set_assignment(Settings& settings, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos) {
    throw Error("--set: found '" + assignment + "', expected key=value");
  }
  set(settings, assignment.substr(0, equals), assignment.substr(equals + 1), "--set");
}

void load_text(Settings& settings, const std::string& yaml, const std::string& name) {
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

void load(Settings& settings, const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  if (std::filesystem::is_directory(file) || !(text << in.rdbuf())) {
    if (!std::filesystem::is_regular_file(file) || std::filesystem::file_size(file) > 0) {
      throw Error(file.string() + ": cannot be opened, expected a YAML file of settings");
    }
  }
  load_text(settings, text.str(), file.string());
}

std::string to_yaml(const Settings& settings, bool comments) {
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

std::string to_markdown(const Settings& defaults) {
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

}  // namespace lamina::apps
