// Wheels that err in a lawful way, found by the map they give.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <lamina/apps/front_end.hpp>
#include <lamina/backend/mapper_options.hpp>
#include <lamina/backend/wheel_errors.hpp>

namespace lamina::apps {

/// No scan among the steps: nothing but wheels told the motion between images, and an error of
/// theirs in every step bends the map. Level scanners are matched scan by scan; one that looks
/// another way tells too little of the path for this.
bool wheels_and_images_alone(const std::vector<Step>& steps);

/// Maps the steps, estimates scale, drift and turn scale of the wheels, and
/// the heading of the cameras against their direction of travel, with the refined graph, and
/// goes on with motions so corrected until the estimate stays. Where the errors stand out from what
/// chance gives, motions and mountings of `steps` are replaced and the errors given; nullopt, and
/// steps as they were, where they do not. `ended` returning true stops early.
std::optional<WheelErrors> calibrate_wheels(std::vector<Step>& steps, const MapperOptions& options,
                                            const std::function<bool()>& ended);

}  // namespace lamina::apps
