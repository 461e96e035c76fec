// The built-in worlds, one function each (see world.cpp for what they are).
#pragma once

#include <lamina/sim/settings.hpp>

namespace lamina::sim {

// builtin_floor.cpp: what a robot on a floor sees in front of it
void build_flat(Settings& s, World& world);
void build_steps(Settings& s, World& world);
void build_plates(Settings& s, World& world);
void build_obstacle_bed(Settings& s, World& world);
// builtin_holes.cpp
void build_hole(Settings& s, World& world);
void build_hole_no_wall(Settings& s, World& world);
void build_stairs_down(Settings& s, World& world);
// builtin_rooms.cpp
void build_room(Settings& s, World& world);
void build_corridor_loop(Settings& s, World& world);
void build_office(Settings& s, World& world);
void build_long_corridor(Settings& s, World& world);
// builtin_slopes.cpp
void build_ramp(Settings& s, World& world);
// builtin_swells.cpp
void build_uneven(Settings& s, World& world);
// builtin_flights.cpp
void build_flyover(Settings& s, World& world);
void build_roof_ridge(Settings& s, World& world);
void build_lost_altitude(Settings& s, World& world);
void build_lost_roll(Settings& s, World& world);
void build_side_laser(Settings& s, World& world);

}  // namespace lamina::sim
