// By name in spdlog's registry.
#include <lamina/pipeline/calibration/log.hpp>

#include <spdlog/spdlog.h>

namespace lamina {

spdlog::logger& run_log() {
  static spdlog::logger silent("silent");
  const auto registered = spdlog::get("lamina");  // which keeps it
  return registered ? *registered : silent;
}

}  // namespace lamina
