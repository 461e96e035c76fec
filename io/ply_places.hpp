// Places in binary PLY files: floats, or doubles where the map lies far from its origin.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

namespace lamina::io {

static_assert(std::endian::native == std::endian::little, "PLY files are written little-endian");

template <class T>
void put(std::string& out, T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out.append(bytes, sizeof(T));
}

/// Floats are 0.06 mm apart at 1 km, but 0.5 m at 5,000 km, as UTM has it.
class PlyPlaces {
 public:
  /// To be shown all places before the first is written, m.
  void see(const Eigen::Vector3d& place) { wide_ = wide_ || !(place.cwiseAbs().maxCoeff() < kFar); }
  std::string properties() const {
    const std::string kind = wide_ ? "property double " : "property float ";
    return kind + "x\n" + kind + "y\n" + kind + "z\n";
  }
  void write(std::string& out, const Eigen::Vector3d& place) const {
    for (int k = 0; k < 3; ++k) {
      wide_ ? put(out, place[k]) : put(out, static_cast<float>(place[k]));
    }
  }

 private:
  static constexpr double kFar = 1000;  // m
  bool wide_ = false;
};

}  // namespace lamina::io
