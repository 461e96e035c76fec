// Ceres cost functions of all factors. Parameter blocks are those of states.hpp, in the order of
// each term's states; residuals are whitened. Ownership goes to the caller.
#pragma once

#include <memory>

#include <lamina/backend/graph/graph.hpp>

namespace ceres {
class CostFunction;
}

namespace lamina {

struct OdometryTerm;
struct PlanarOdometryTerm;
struct PriorTerm;
struct PlaneMomentsTerm;
struct OdometryOfSensorTerm;
struct PlaneMomentsOfSensorTerm;
struct SegmentTerm;
struct GravityTerm;
struct SurfelMomentsOwnTerm;
struct SurfelMomentsTerm;
struct SurfelParentTerm;

ceres::CostFunction* make_cost(const OdometryTerm& term);              ///< pose, pose
ceres::CostFunction* make_cost(const PlanarOdometryTerm& term);        ///< pose, pose
ceres::CostFunction* make_cost(const PriorTerm& term);                 ///< pose
ceres::CostFunction* make_cost(const PlaneMomentsTerm& term);          ///< pose, plane
ceres::CostFunction* make_cost(const OdometryOfSensorTerm& term);      ///< pose, pose, sensor
ceres::CostFunction* make_cost(const PlaneMomentsOfSensorTerm& term);  ///< pose, plane, sensor
ceres::CostFunction* make_cost(const SegmentTerm& term);               ///< pose, plane
ceres::CostFunction* make_cost(const GravityTerm& term);               ///< pose
ceres::CostFunction* make_cost(const SurfelMomentsOwnTerm& term);      ///< surfel
ceres::CostFunction* make_cost(const SurfelMomentsTerm& term);  ///< seeing pose, carrier, surfel
ceres::CostFunction* make_cost(const SurfelParentTerm& term);   ///< carrier, plane, surfel
/// Blocks: the prior's keyframes, planes, surfels in its order. Keeps a copy of the prior.
ceres::CostFunction* make_cost(const MarginalPrior& prior);

}  // namespace lamina
