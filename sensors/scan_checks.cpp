// Checks of scans.
#include <lamina/sensors/scan_checks.hpp>

#include <cmath>
#include <cstdio>

namespace lamina {
namespace {

double span_of(double angle_increment, std::size_t beams) {
  return beams < 2 ? 0 : std::abs(angle_increment) * static_cast<double>(beams - 1);
}

}  // namespace

bool beyond_one_turn(double angle_increment, std::size_t beams) {
  return span_of(angle_increment, beams) > 2 * M_PI + 0.5 * std::abs(angle_increment);
}

std::string beyond_one_turn_text(double angle_increment, std::size_t beams) {
  char text[160];
  std::snprintf(text, sizeof text,
                "found %zu beams %.6g rad apart, %.6g rad in all, expected one turn (6.28319 rad) "
                "at most",
                beams, angle_increment, span_of(angle_increment, beams));
  return text;
}

}  // namespace lamina
