// Conversions between settings and text.
#include <lamina/pipeline/config/setting.hpp>

#include <charconv>
#include <cmath>
#include <stdexcept>

namespace lamina::text {
namespace {

std::string trimmed(const std::string& from) {
  const auto first = from.find_first_not_of(" \t");
  if (first == std::string::npos) return "";
  return from.substr(first, from.find_last_not_of(" \t") - first + 1);
}

template <class T>
void read_number(const std::string& from, T& to, const char* expected) {
  const std::string text = trimmed(from);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw std::invalid_argument(expected);
  }
  to = value;
}

}  // namespace

std::string write(bool value) { return value ? "true" : "false"; }
std::string write(int value) { return std::to_string(value); }
std::string write(const std::string& value) { return value.empty() ? "\"\"" : value; }

std::string write(double value) {
  char buffer[40];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, result.ptr);
}

void read(const std::string& from, bool& to) {
  const std::string text = trimmed(from);
  if (text != "true" && text != "false") throw std::invalid_argument("true or false");
  to = text == "true";
}

void read(const std::string& from, int& to) { read_number(from, to, "a whole number"); }

void read(const std::string& from, double& to) {
  double value = 0;
  read_number(from, value, "a number");
  if (!std::isfinite(value)) throw std::invalid_argument("a finite number");
  to = value;
}

void read(const std::string& from, std::string& to) {
  to = trimmed(from);
  if (to.size() >= 2 && to.front() == '"' && to.back() == '"') to = to.substr(1, to.size() - 2);
}

std::vector<std::string> items(const std::string& from, std::size_t expected) {
  const std::string text = trimmed(from);
  const std::string wanted = "[...] with " + std::to_string(expected) + " values";
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') {
    throw std::invalid_argument(wanted);
  }
  std::vector<std::string> parts{""};
  for (const char c : text.substr(1, text.size() - 2)) {
    if (c == ',') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  if (parts.size() != expected) throw std::invalid_argument(wanted);
  return parts;
}

}  // namespace lamina::text
