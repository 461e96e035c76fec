// What data say of an error in how sensors sit on the body, no prior of it counted.
#pragma once

#include <Eigen/Core>

namespace lamina {

/// A Gaussian in information form of e = (x, y, heading; m, rad): points in the body's frame are
/// truly at E(e) x where the mounting has x. Zero: nothing known.
struct MountingEvidence {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();  ///< information times the most likely e
};

}  // namespace lamina
