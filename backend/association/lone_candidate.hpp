// A candidate that nothing near can be taken for.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include <lamina/backend/association/association.hpp>

namespace lamina {

/// No other of the candidates at this place faces the same way, to 40 degrees: it is this one
/// whichever way the prediction is off.
inline bool is_unambiguous(const AssociationCandidate& candidate,
                           std::span<const AssociationCandidate> all) {
  constexpr double kAlike = 40 * M_PI / 180;
  return std::none_of(all.begin(), all.end(), [&](const AssociationCandidate& other) {
    return other.id != candidate.id &&
           angle_between(other.plane_anchor, candidate.plane_anchor) < kAlike;
  });
}

}  // namespace lamina
