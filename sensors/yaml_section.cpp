// YAML mappings with messages that name file, line and key.
#include <lamina/sensors/yaml_section.hpp>

#include <cmath>
#include <set>

#include <lamina/models/error.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {
constexpr std::size_t kLargestFile = 1 << 20;  // a calibration is a screen of text
constexpr int kDeepestFlow = 64;               // brackets within brackets

std::string one_line(const YAML::Node& node) {
  if (node.IsScalar()) return shown(node.Scalar());
  if (node.IsSequence()) return "a list of " + std::to_string(node.size());
  if (node.IsMap()) return "a mapping";
  return "nothing";
}

// yaml-cpp descends recursively: refuse what no calibration needs before it sees it.
void check_nesting(const std::string& text, const std::string& file) {
  int depth = 0, indent_marks = 0;
  std::string_view line;
  for (LineReader lines(text); lines.next(line);) {
    indent_marks = 0;
    for (const char c : line) {
      depth += (c == '[' || c == '{') ? 1 : (c == ']' || c == '}') ? -1 : 0;
      indent_marks += (c == '-' || c == '?' || c == ':' || c == '!' || c == '&') ? 1 : 0;
      if (depth > kDeepestFlow || indent_marks > 16 * kDeepestFlow) {
        throw input_error(file, std::to_string(lines.number()), "nesting beyond all use",
                          "a calibration");
      }
    }
  }
}
}  // namespace

YamlSection YamlSection::parse(const std::string& text, const std::string& file) {
  if (text.size() > kLargestFile) {
    throw input_error(file, "", std::to_string(text.size()) + " bytes", "at most 1 MiB of YAML");
  }
  if (text.find('\0') != std::string::npos) {
    throw input_error(file, "", "binary data", "YAML text");
  }
  check_nesting(text, file);
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw input_error(file, std::to_string(error.mark.line + 1),
                      "bad YAML (" + error.msg.substr(0, error.msg.find('\n')) + ")",
                      "`key: value` lines");
  }
  if (!root.IsDefined() || root.IsNull()) {
    throw input_error(file, "", "an empty file", "`key: value` lines");
  }
  if (!root.IsMap()) throw input_error(file, "1", one_line(root), "`key: value` lines");
  return {root, "", file};
}

void YamlSection::fail(const std::string& key, const std::string& found,
                       const std::string& expected) const {
  YAML::Mark mark = node_.Mark();
  if (has(key)) mark = at(key).Mark();
  const std::string name = path_.empty() ? key : key.empty() ? path_ : path_ + "." + key;
  const std::string line = mark.line >= 0 ? std::to_string(mark.line + 1) + ": " : "";
  throw input_error(file_, line + name, found, expected);
}

void YamlSection::check_keys(std::initializer_list<std::string_view> known) const {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) fail("", "a key that is " + one_line(entry.first), "a name");
    const std::string key = entry.first.Scalar();
    const std::string line = std::to_string(entry.first.Mark().line + 1);
    const std::string name = path_.empty() ? "" : ": " + path_;
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      const std::vector<std::string_view> names(known);
      throw input_error(file_, line + name, "unknown key " + shown(key),
                        "a known one: did you mean '" + nearest_name(key, names) + "'?");
    }
    if (!seen.insert(key).second) {
      throw input_error(file_, line + name, "key " + shown(key) + " a second time",
                        "each key once");
    }
  }
}

YAML::Node YamlSection::at(const std::string& key) const {
  for (const auto& entry : node_) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.second;
  }
  return YAML::Node(YAML::NodeType::Null);
}

bool YamlSection::has(const std::string& key) const { return !at(key).IsNull(); }

YamlSection YamlSection::section(const std::string& key) const {
  const YAML::Node node = at(key);
  if (!node.IsMap()) fail(key, one_line(node), "`key: value` lines");
  return {node, path_.empty() ? key : path_ + "." + key, file_};
}

double YamlSection::checked(const std::string& key, const NumberRule& rule) const {
  const YAML::Node node = at(key);
  if (!node.IsScalar()) fail(key, one_line(node), rule.wording);
  const auto value = parse_number(node.Scalar());
  const bool good = value && *value <= rule.highest &&
                    (rule.lowest_allowed ? *value >= rule.lowest : *value > rule.lowest);
  if (!good) fail(key, shown(node.Scalar()), rule.wording);
  return *value;
}

double YamlSection::number(const std::string& key, const NumberRule& rule) const {
  return checked(key, rule);
}

double YamlSection::number_or(const std::string& key, const NumberRule& rule,
                              double fallback) const {
  return has(key) ? checked(key, rule) : fallback;
}

int YamlSection::integer(const std::string& key, const NumberRule& rule) const {
  const double value = checked(key, rule);
  if (value != std::floor(value)) fail(key, one_line(at(key)), rule.wording);
  return static_cast<int>(value);
}

bool YamlSection::boolean_or(const std::string& key, bool fallback) const {
  if (!has(key)) return fallback;
  const YAML::Node node = at(key);
  bool value = false;
  if (!node.IsScalar() || !YAML::convert<bool>::decode(node, value)) {
    fail(key, one_line(node), "true or false");
  }
  return value;
}

std::string YamlSection::text_or(const std::string& key, const std::string& fallback) const {
  if (!has(key)) return fallback;
  const YAML::Node node = at(key);
  if (!node.IsScalar()) fail(key, one_line(node), "a word");
  return node.Scalar();
}

std::optional<std::vector<double>> YamlSection::numbers(const std::string& key,
                                                        std::size_t count) const {
  if (!has(key)) return std::nullopt;
  const YAML::Node node = at(key);
  const std::string expected = "a list of " + std::to_string(count) + " numbers";
  if (!node.IsSequence() || node.size() != count) fail(key, one_line(node), expected);
  std::vector<double> values;
  for (const auto& item : node) {
    const auto value = item.IsScalar() ? parse_number(item.Scalar()) : std::nullopt;
    if (!value) fail(key, one_line(item), expected);
    values.push_back(*value);
  }
  return values;
}

}  // namespace lamina
