// What no scan can be, whoever recorded it.
#pragma once

#include <cstddef>
#include <string>

namespace lamina {

/// True where `beams` beams `angle_increment` rad apart go around by more than a turn and half a
/// beam: such an increment is in degrees, or belongs to another number of beams.
bool beyond_one_turn(double angle_increment, std::size_t beams);

/// What was found and expected then, for messages.
std::string beyond_one_turn_text(double angle_increment, std::size_t beams);

}  // namespace lamina
