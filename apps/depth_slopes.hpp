// Slopes of a depth image's error, found by the map it gives.
#pragma once

#include <functional>
#include <optional>

#include <lamina/apps/front_end.hpp>
#include <lamina/apps/settings.hpp>
#include <lamina/backend/depth_errors.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {

/// Maps steps of wheels and images of one depth camera and estimates what errors both have in
/// common over all of them (DepthErrors), goes on with steps so corrected until the estimate stays.
/// The constant is zero unless it stands out. nullopt where steps do not tell: no plane, no motion,
/// or `ended` returned true.
std::optional<DepthErrors> depth_errors_of(const std::vector<Step>& steps,
                                           const MapperOptions& options,
                                           const std::function<bool()>& ended);

/// A look over the first minutes of a recording whose wheels and depth camera tell it:
/// `distortion`, which is taken out of images, with the slopes they have beside it. Scans are
/// passed over. nullopt where slopes do not stand out, or there are no wheels.
std::optional<DepthDistortion> find_depth_slopes(Recording& recording, const Settings& settings,
                                                 const DepthDistortion& distortion,
                                                 io::Metrics& metrics,
                                                 const std::function<bool()>& ended);

}  // namespace lamina::apps
