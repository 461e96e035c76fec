// Codes of depths, and squares about a place.
#include <lamina/models/depth_look.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace lamina {
namespace {

constexpr double kStep = 1.02;

std::array<double, 256> depths() {
  std::array<double, 256> all{};
  for (std::size_t k = 1; k < all.size(); ++k) {
    all[k] = DepthLook::kNearest * std::pow(kStep, static_cast<double>(k - 1));
  }
  return all;
}

}  // namespace

double DepthLook::depth(std::uint8_t code) {
  static const std::array<double, 256> all = depths();
  return all[code];
}

std::uint8_t DepthLook::code(double depth_m) {
  if (!(depth_m >= kNearest)) return 0;
  const double k = 1 + std::floor(std::log(depth_m / kNearest) / std::log(kStep) + 1e-9);
  return static_cast<std::uint8_t>(std::min(k, 255.0));
}

Sight DepthLook::at(const Eigen::Vector3d& p, double radius) const {
  const double z = p.z();
  if (!(z > kNearest) || empty()) return Sight::kUnknown;
  const auto from = [&](double f, double x, double c) {
    return std::floor(f * (x - radius) / z + c);
  };
  const auto to = [&](double f, double x, double c) {
    return std::floor(f * (x + radius) / z + c);
  };
  const double u0 = from(static_cast<double>(fx), p.x(), static_cast<double>(cx)),
               u1 = to(static_cast<double>(fx), p.x(), static_cast<double>(cx)),
               v0 = from(static_cast<double>(fy), p.y(), static_cast<double>(cy)),
               v1 = to(static_cast<double>(fy), p.y(), static_cast<double>(cy));
  if (!(u1 >= 0 && v1 >= 0 && u0 < nx && v0 < ny)) return Sight::kUnknown;
  const auto square = [](double at, std::int32_t n) {
    return static_cast<std::int32_t>(std::clamp(at, 0.0, n - 1.0));
  };
  const double far = margin(z);
  bool past = u0 >= 0 && v0 >= 0 && u1 < nx && v1 < ny;
  for (std::int32_t j = square(v0, ny); j <= square(v1, ny); ++j) {
    for (std::int32_t i = square(u0, nx); i <= square(u1, nx); ++i) {
      const auto k =
          static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
      const double behind = depth(reach[k]) - z;
      if (std::abs(behind) <= far) return Sight::kMet;
      past = past && behind > far;
    }
  }
  return past ? Sight::kPast : Sight::kUnknown;
}

}  // namespace lamina
