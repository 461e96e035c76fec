// What a recording gives where its reader knows no shorter way. Stands apart from the choice of
// readers: one of them alone links without the others.
#include <lamina/sensors/recording.hpp>

namespace lamina {

std::optional<DepthFrame> Recording::next_depth(std::int64_t skip) {
  while (auto measurement = next()) {
    auto* frame = std::get_if<DepthFrame>(&*measurement);
    if (frame && skip-- <= 0) return std::move(*frame);
  }
  return std::nullopt;
}

std::optional<Measurement> Recording::next_light() {
  while (auto measurement = next()) {
    if (!std::holds_alternative<DepthFrame>(*measurement) &&
        !std::holds_alternative<StereoFrame>(*measurement) &&
        !std::holds_alternative<CloudFrame>(*measurement)) {
      return measurement;
    }
  }
  return std::nullopt;
}

}  // namespace lamina
