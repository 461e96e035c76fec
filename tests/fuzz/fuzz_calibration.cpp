// calibration.yaml: an Error of one line, or cameras that can be divided by.
#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration.hpp>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  try {
    const std::string text(lamina::fuzz::text_of(data, size));
    const lamina::Calibration c = lamina::parse_calibration(text, "c.yaml");
    if (c.depth_camera) {
      demand(c.depth_camera->camera.fx > 0 && c.depth_camera->depth_scale > 0);
      demand(c.depth_camera->camera.width > 0 && c.depth_camera->camera.height > 0);
      demand(c.depth_camera->noise.sigma_depth(1) > 0);
    }
    if (c.stereo_camera) demand(c.stereo_camera->baseline > 0);
    if (c.lidar) demand(c.lidar->T_body_lidar.matrix().allFinite());
  } catch (const lamina::Error& error) {
    demand(std::string_view(error.what()).find('\n') == std::string_view::npos);
  }
  return 0;
}
