// The median of values in no order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace lamina {

/// The middle one by size, the upper of two; zero where there are none. Values that are not numbers
/// have no order: leave them out.
template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return T{};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace lamina
