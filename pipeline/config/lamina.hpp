// All that a program needs that maps a recording or its own sensors: <lamina/lamina.hpp>.
#pragma once

#include <lamina/pipeline/config/map_request.hpp>
#include <lamina/pipeline/config/settings.hpp>
#include <lamina/pipeline/map.hpp>
#include <lamina/pipeline/online_mapper.hpp>
#include <lamina/pipeline/write_results.hpp>
#include <lamina/sensors/measurement.hpp>
#include <lamina/version.hpp>
