// Every setting of the program, one table for loading, saving, help and documentation.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <lamina/pipeline/config/setting.hpp>
#include <lamina/pipeline/map_options.hpp>

namespace lamina {

/// The table, in the order of the documentation.
const std::vector<Setting>& setting_table();

/// Sets one key from text. Throws lamina::Error naming `origin` ("--set", "config.yaml:3"), the key
/// (with the nearest known one when it is unknown), what was found and what was expected.
void set(MapOptions& settings, const std::string& key, const std::string& value,
         const std::string& origin);
/// "key=value".
void set_assignment(MapOptions& settings, const std::string& assignment);
/// Reads a YAML file of nested or dotted keys over the settings.
void load(MapOptions& settings, const std::filesystem::path& file);
/// The same from text; `name` is what messages call it.
void load_text(MapOptions& settings, const std::string& yaml, const std::string& name);
/// All settings as nested YAML with comments; load() gives the same settings back.
std::string to_yaml(const MapOptions& settings, bool comments);
/// docs/parameters.md.
std::string to_markdown(const MapOptions& defaults);
/// All that is wrong with the values together; empty when nothing is.
std::vector<std::string> problems(const MapOptions& settings);

}  // namespace lamina
