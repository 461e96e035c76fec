// Laying steps along a corrected trajectory.
#include <lamina/pipeline/path_correction.hpp>

#include <algorithm>

namespace lamina {

void follow(std::vector<Step>& steps, const Trajectory& corrected) {
  if (steps.empty()) return;
  // T_new_start: where the chain of dead reckoning lies, by the last scan.
  SE3 T_new_start;
  for (const Step& step : steps) {
    if (const auto pose = step.scan ? corrected.at(step.observations.stamp) : std::nullopt) {
      T_new_start = *pose * step.T_start_body.inverse();
      break;
    }
  }
  SE3 T_new_last;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    Step& step = steps[i];
    if (const auto pose = step.scan ? corrected.at(step.observations.stamp) : std::nullopt) {
      T_new_start = *pose * step.T_start_body.inverse();
    }
    const SE3 T_new_body = T_new_start * step.T_start_body;
    if (i > 0) step.motion.T_from_to = T_new_last.inverse() * T_new_body;
    T_new_last = T_new_body;
  }
}

bool begin_levelled(std::vector<Step>& steps) {
  constexpr double kNone = 1e-9;
  const auto shows_floor = [](const Step& step) {
    return step.T_body_levelled.log().norm() > kNone;  // else the calibration's own level
  };
  const auto seen = std::find_if(steps.begin(), steps.end(), shows_floor);
  if (seen == steps.end()) return false;
  const SE3 T_start_first = steps.front().T_start_body;
  const SE3 T_level_first =
      seen->T_body_levelled.inverse() * seen->T_start_body.inverse() * T_start_first;
  const SE3 T_map_first(SO3::rot_z(-T_level_first.so3().yaw()) * T_level_first.so3(),
                        {0, 0, T_level_first.translation().z()});
  const SE3 T_map_start = T_map_first * T_start_first.inverse();
  steps.front().motion.T_from_to = T_map_start * steps.front().motion.T_from_to;
  for (Step& step : steps) step.T_start_body = T_map_start * step.T_start_body;
  return true;
}

}  // namespace lamina
