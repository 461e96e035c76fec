// One row of the option table: a key, its text, and how it is read and written.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

namespace lamina {

struct MapOptions;

/// A setting by name. `write` gives the value in force as YAML text, `read` takes YAML text and
/// throws std::invalid_argument saying what was expected.
struct Setting {
  std::string key;      ///< e.g. "window.keyframes"
  std::string comment;  ///< what it does, its unit and why the default is what it is
  std::function<std::string(const MapOptions&)> write;
  std::function<void(MapOptions&, const std::string&)> read;
};

namespace text {
// Plain conversions; each read_ throws std::invalid_argument("a number") and the like.
std::string write(bool value);
std::string write(int value);
std::string write(double value);
std::string write(const std::string& value);
void read(const std::string& from, bool& to);
void read(const std::string& from, int& to);
void read(const std::string& from, double& to);
void read(const std::string& from, std::string& to);
/// "[a, b, c]" to its items.
std::vector<std::string> items(const std::string& from, std::size_t expected);

template <class T, std::size_t N>
std::string write(const std::array<T, N>& value) {
  std::string out = "[";
  for (std::size_t i = 0; i < N; ++i) out += (i ? ", " : "") + write(value[i]);
  return out + "]";
}
template <class T, std::size_t N>
void read(const std::string& from, std::array<T, N>& to) {
  const auto parts = items(from, N);
  for (std::size_t i = 0; i < N; ++i) read(parts[i], to[i]);
}
inline std::string write(const Eigen::Vector3d& v) {
  return write(std::array<double, 3>{v.x(), v.y(), v.z()});
}
inline void read(const std::string& from, Eigen::Vector3d& to) {
  std::array<double, 3> v{};
  read(from, v);
  to = {v[0], v[1], v[2]};
}
}  // namespace text

/// A row for the member that `member(settings)` gives by reference.
template <class Member>
Setting row(std::string key, Member member, std::string comment) {
  return {std::move(key), std::move(comment),
          [member](const MapOptions& s) { return text::write(member(const_cast<MapOptions&>(s))); },
          [member](MapOptions& s, const std::string& from) { text::read(from, member(s)); }};
}

/// The same for an angle that the program holds in radians and people give in degrees.
template <class Member>
Setting row_deg(std::string key, Member member, std::string comment) {
  constexpr double kDegree = M_PI / 180.0;
  return {std::move(key), std::move(comment),
          [member](const MapOptions& s) {
            return text::write(member(const_cast<MapOptions&>(s)) / kDegree);
          },
          [member](MapOptions& s, const std::string& from) {
            double degrees = 0;
            text::read(from, degrees);
            member(s) = degrees * kDegree;
          }};
}

/// A row for an enumeration, by the names of its values in order.
template <class Member>
Setting row_enum(std::string key, Member member, std::vector<std::string> names,
                 std::string comment) {
  return {std::move(key), std::move(comment),
          [member, names](const MapOptions& s) {
            return names.at(static_cast<std::size_t>(member(const_cast<MapOptions&>(s))));
          },
          [member, names](MapOptions& s, const std::string& from) {
            using Enum = std::remove_reference_t<decltype(member(s))>;
            std::string expected = "one of";
            for (std::size_t i = 0; i < names.size(); ++i) {
              if (names[i] == from) {
                member(s) = static_cast<Enum>(i);
                return;
              }
              expected += " " + names[i];
            }
            throw std::invalid_argument(expected);
          }};
}

}  // namespace lamina
