// A mapping in a YAML file, read with exact messages. For .cpp files only: it includes yaml-cpp.
#pragma once

#include <yaml-cpp/yaml.h>

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lamina {

/// Bounds a number must keep, and how a message words them.
struct NumberRule {
  double lowest, highest;
  bool lowest_allowed;
  const char* wording;
};
inline constexpr NumberRule kAnyNumber{-1e12, 1e12, true, "a number"};
inline constexpr NumberRule kPositive{0, 1e12, false, "a number above 0"};
inline constexpr NumberRule kNotNegative{0, 1e12, true, "a number of 0 or more"};
inline constexpr NumberRule kImageSize{1, 16384, true, "a whole number from 1 to 16384"};

/// One mapping of the file; `path` is its dotted name ("depth_camera"), empty at the root.
class YamlSection {
 public:
  /// Parses the text; throws lamina::Error for bad YAML or a root that is no mapping.
  static YamlSection parse(const std::string& text, const std::string& file);

  /// Throws for a key outside `known` (naming the nearest) and for a key given twice.
  void check_keys(std::initializer_list<std::string_view> known) const;
  bool has(const std::string& key) const;
  /// The mapping under `key`; throws when it is none.
  YamlSection section(const std::string& key) const;
  /// Throws when absent or against the rule.
  double number(const std::string& key, const NumberRule& rule) const;
  double number_or(const std::string& key, const NumberRule& rule, double fallback) const;
  int integer(const std::string& key, const NumberRule& rule) const;
  bool boolean_or(const std::string& key, bool fallback) const;
  std::string text_or(const std::string& key, const std::string& fallback) const;
  /// `count` finite numbers, or nullopt when the key is absent.
  std::optional<std::vector<double>> numbers(const std::string& key, std::size_t count) const;
  /// Throws lamina::Error at a key (or at the section, for an absent key).
  [[noreturn]] void fail(const std::string& key, const std::string& found,
                         const std::string& expected) const;

 private:
  YamlSection(YAML::Node node, std::string path, std::string file)
      : node_(std::move(node)), path_(std::move(path)), file_(std::move(file)) {}
  YAML::Node at(const std::string& key) const;
  double checked(const std::string& key, const NumberRule& rule) const;

  YAML::Node node_;
  std::string path_, file_;
};

}  // namespace lamina
