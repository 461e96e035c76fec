// Text of what a check found.
#pragma once

#include <sstream>

#include <lamina/testing/factor_tester.hpp>

namespace lamina::detail {

/// A failure that says all parts, one after the other.
template <class... Parts>
FactorReport failure(const Parts&... parts) {
  std::ostringstream out;
  out.precision(17);  // all digits of a double
  (out << ... << parts);
  return FactorReport::failure(out.str());
}

}  // namespace lamina::detail
