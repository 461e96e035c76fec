// A run's steps made a map: offline with all of the recording at hand, online step by step.
#pragma once

#include <lamina/apps/steps.hpp>
#include <lamina/backend/mapper.hpp>

namespace lamina::apps {

/// Dead reckoning and loops over the whole recording first, so that the mapper meets old planes
/// where they are; then what the known path says of sensors, window, loops and refinement.
Mapper map_offline(Run& run);

/// What a robot would have had at each instant.
Mapper map_online(Run& run);

}  // namespace lamina::apps
