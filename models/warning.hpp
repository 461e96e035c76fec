// What a person should know of a result: a sentence under the short name of its cause.
#pragma once

#include <string>

namespace lamina {

struct Warning {
  std::string id;    ///< snake_case, names the cause: "clock_order", "scan_mirrored", ...
  std::string text;  ///< one line: what was found, what it means for the map, what to do
};

}  // namespace lamina
