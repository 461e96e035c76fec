// Steps in a hole of the odometry, once it is known where the hole ends.
#pragma once

#include <cstdint>
#include <vector>

#include <lamina/frontend/frontend.hpp>

namespace lamina {

/// Where images lost track in a hole that wheels counted across (Step::across_hole), its steps are
/// laid along the screw from where it begins to where it ends, by their stamps: a guess that images
/// correct, with the end where the wheels have it. Returns how many steps that are.
std::int64_t lay_across_holes(std::vector<Step>& steps);

}  // namespace lamina
