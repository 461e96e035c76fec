// Which settings cannot be.
#include <lamina/backend/mapper/mapper_options.hpp>

namespace lamina {

std::vector<std::string> MapperOptions::problems() const {
  std::vector<std::string> result;
  for (const auto& of_part : {window.problems(), association.problems(), place.problems(),
                              labels.problems(), joint_surfels.problems()}) {
    result.insert(result.end(), of_part.begin(), of_part.end());
  }
  const auto positive = [&result](double value, const char* name) {
    if (!(value > 0)) result.push_back(std::string("mapper.") + name + ": expected more than 0");
  };
  positive(keyframe_distance_m, "keyframe_distance_m");
  positive(keyframe_angle_deg, "keyframe_angle_deg");
  positive(keyframe_new_share, "keyframe_new_share");
  positive(min_observations, "min_observations");
  positive(forget_keyframes, "forget_keyframes");
  positive(prior_tilt_deg, "prior_tilt_deg");
  positive(prior_distance_m, "prior_distance_m");
  positive(unobserved_share, "unobserved_share");
  positive(outline_cell_m, "outline_cell_m");
  positive(surfel_cell_m, "surfel_cell_m");
  positive(surfel_parent_sigma_m, "surfel_parent_sigma_m");
  positive(surfel_parent_slope_deg, "surfel_parent_slope_deg");
  return result;
}

}  // namespace lamina
