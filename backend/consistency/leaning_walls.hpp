// Walls that noisy images drew again, leaning.
#pragma once

#include <cstddef>
#include <vector>

#include <lamina/models/planar_map.hpp>

namespace lamina {

/// Leaves out planes of 1 m^2 and more that lean by three degrees or more, twice as much as a wall
/// that they go through, which was seen four times as often: within 20 degrees of it, seen from its
/// side, three fifths of their outline before or behind it (to half a metre), and more than 15 % of
/// that on either side of it. What lies behind a wall is not seen: far walls lean so where their
/// range is noisy over whole images (stereo), and would bar the floor before the wall. Returns how
/// many; the others keep their order.
std::size_t leave_out_leaning(std::vector<MapPlane>& planes);

}  // namespace lamina
