// Another look over a recording's depth images, beside the run that reads all of it.
#pragma once

#include <optional>

#include <lamina/models/error.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// Recording::next_depth(), where what cannot be read ends the look: the run itself comes to it, or
/// has, and says so.
inline std::optional<DepthFrame> next_depth_image(Recording& recording, std::int64_t skip) {
  try {
    return recording.next_depth(skip);
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace lamina
