// Laying steps along a corrected trajectory.
#include <lamina/apps/dead_reckoning.hpp>

namespace lamina::apps {

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

}  // namespace lamina::apps
