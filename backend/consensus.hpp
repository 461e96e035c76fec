// Which observations of one plane agree with each other, by odometry alone.
#pragma once

#include <vector>

#include <lamina/backend/graph.hpp>

namespace lamina {

/// For every plane_moments factor 1 (has agreeing neighbours in time, or is its plane's only
/// evidence) or 0. Two observations agree when one plane fits both: the least eigenvalue of their
/// merged scatter, a chi-squared, is at most `inlier_chi2` once each has been discounted by what
/// odometry may have drifted between them. Keyframes further apart than odometry tells are not
/// compared: a second visit forms its own group.
/// Also sets each plane that has a group to the fit of its largest one (the earliest of equals).
std::vector<double> agreeing_observations(Graph& graph, double inlier_chi2);

}  // namespace lamina
