// What is claimed of a depth camera, against what its images show.
#pragma once

#include <lamina/frontend/depth/mounting_check.hpp>
#include <lamina/frontend/depth/noise_watch.hpp>
#include <lamina/frontend/depth/optical_watch.hpp>

namespace lamina {

struct DepthChecks {
  NoiseWatch noise;       ///< how noisy images are, against what their calibration says
  OpticalWatch optical;   ///< where they show floor, if their calibration turns nothing
  FloorsAsStated floors;  ///< how many of them show floor where their mounting says

  void add(const DepthFrame& frame, const FloorResult& floor) {
    floors.add(frame, floor);
    optical.add(floor, frame.camera.camera.T_body_camera);
    const bool ideal = frame.camera.noise.kind == DepthNoise::Kind::kIdeal;
    noise.add(floor.noise_scale / (ideal ? raised_by_rounding(frame) : 1));
  }

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, DepthChecks& v) {
    auto& [noise, optical, floors] = v;
    a(noise, optical, floors);
  }
};

}  // namespace lamina
