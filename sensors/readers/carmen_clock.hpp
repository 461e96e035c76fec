// Which clock of a CARMEN log to use, how its stamps are written, and what of them can be believed.
#pragma once

#include <string>
#include <vector>

#include <lamina/models/warning.hpp>
#include <lamina/sensors/readers/carmen_index.hpp>

namespace lamina {

struct CarmenClock {
  std::vector<Warning> warnings;
  std::vector<std::string> remarks;
};

/// Gives every scan that is used and every ODOM line of the index its time; `file` stands in
/// messages. Lines are in the order of writing: where stamps cannot order them, that does.
CarmenClock apply_carmen_clock(CarmenIndex& index, const std::string& file);

}  // namespace lamina
