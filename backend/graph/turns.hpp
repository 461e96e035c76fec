// Of factors, what tells directions alone: rotations between keyframes, tilts of planes.
#pragma once

#include <utility>

#include <lamina/models/moments.hpp>

namespace lamina {

/// A factor whose residual begins with `positions` numbers that say where things are: those weigh
/// nothing.
template <class Factor>
Factor without_positions(Factor factor, int positions) {
  factor.sqrt_information.leftCols(positions).setZero();
  return factor;
}

/// Moments that tell a plane's tilt and not its distance.
inline Moments without_positions(const Moments& m) {
  return Moments(0, m.mean(), m.scatter(), m.count());
}

}  // namespace lamina
