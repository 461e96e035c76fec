// Dead reckoning with loops closed: what offline mapping starts from.
#pragma once

#include <vector>

#include <lamina/frontend/frontend.hpp>
#include <lamina/models/trajectory.hpp>

namespace lamina {

/// Replaces each step's motion by that of a trajectory in which loops are closed (given at the
/// scans; steps in between keep their motion relative to the scan before). Association then meets
/// old planes where they are instead of metres away. Covariances stay those of the motion.
void follow(std::vector<Step>& steps, const Trajectory& corrected);

/// Images alone whose first shows no floor: the first one that does says how the body stood when
/// the recording began. Turns and lifts the start so (levelled_pose()), motions stay. False where
/// no image shows a floor.
bool begin_levelled(std::vector<Step>& steps);

}  // namespace lamina
