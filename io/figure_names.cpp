// One table of names and members.
#include <lamina/io/figure_names.hpp>

namespace lamina::io {
namespace {

// call(name, figure) for each figure of one sensor.
template <class Sensor, class Call>
void for_each_of(const std::string& name, Sensor& sensor, Call&& call) {
  call(name + "_clock_ms", sensor.clock_ms);
  for (std::size_t k = 0; k < 3; ++k) {
    call(name + "_turned_" + "xyz"[k] + "_deg", sensor.turned_deg[k]);
    call(name + "_moved_" + "xyz"[k] + "_cm", sensor.moved_cm[k]);
  }
}

// Of sensors, and of what was found of them.
template <class All, class Call>
void for_each_sensor(All& figures, Call&& call) {
  call("depth_noise_over_calibration", figures.depth_noise_over_calibration);
  call("scanner_noise_cm", figures.scanner_noise_cm);
  call("scanner_sweep_ms", figures.scanner_sweep_ms);
  call("start_tilt_deg", figures.start_tilt_deg);
  call("camera_start_roll_deg", figures.camera_start_roll_deg);
  call("camera_start_pitch_deg", figures.camera_start_pitch_deg);
  call("camera_start_height_m", figures.camera_start_height_m);
  call("depth_bend_rms_px", figures.depth_bend_rms_px);
  call("depth_bend_max_px", figures.depth_bend_max_px);
  call("depth_focal_px", figures.depth_focal_px);
  call("mounting_heading_sigma_deg", figures.mounting_heading_sigma_deg);
  call("mounting_place_sigma_cm", figures.mounting_place_sigma_cm);
  call("wheel_scale_correction", figures.wheel_scale_correction);
  call("wheel_drift_correction_deg_per_m", figures.wheel_drift_correction_deg_per_m);
  call("wheel_turn_correction", figures.wheel_turn_correction);
  call("depth_slope_across_px", figures.depth_slope_px[0]);
  call("depth_slope_down_px", figures.depth_slope_px[1]);
  for_each_of("scanner", figures.scanner, call);
  for_each_of("camera", figures.camera, call);
  for_each_of("odometry", figures.odometry, call);
}

// Of the path: tracking, and stretches that wheels alone measured.
template <class All, class Call>
void for_each_motion(All& figures, Call&& call) {
  call("steps_with_unknown_motion", figures.steps_with_unknown_motion);
  call("steps_with_tracking_lost", figures.steps_with_tracking_lost);
  call("tracking_lost_after_s", figures.tracking_lost_after_s);
  call("steps_with_open_direction", figures.steps_with_open_direction);
  call("open_direction_longest_m", figures.open_direction_longest_m);
  call("scans_with_open_direction", figures.scans_with_open_direction);
  call("scans_open_direction_longest_m", figures.scans_open_direction_longest_m);
  call("scans_left_out", figures.scans_left_out);
  call("ground_returns", figures.ground_returns);
  call("slopes_by_images", figures.slopes_by_images);
  call("motions_by_images", figures.motions_by_images);
  call("by_wheels_alone_m", figures.by_wheels_alone_m);
  call("by_wheels_alone_sigma_m", figures.by_wheels_alone_sigma_m);
  call("way_by_wheels_alone_m", figures.way_by_wheels_alone_m);
  call("heading_by_wheels_alone_m", figures.heading_by_wheels_alone_m);
  call("way_by_wheels_alone_longest_m", figures.way_by_wheels_alone_longest_m);
  call("way_by_wheels_alone_longest_from_s", figures.way_by_wheels_alone_longest_from_s);
  call("way_by_wheels_alone_longest_to_s", figures.way_by_wheels_alone_longest_to_s);
  call("wheels_slipped_m", figures.wheels_slipped_m);
}

template <class All, class Call>
void for_each(All& figures, Call&& call) {
  call("measurements", figures.measurements);
  call("steps", figures.steps);
  call("keyframes", figures.keyframes);
  call("checkpoints", figures.checkpoints);
  call("path_m", figures.path_m);
  call("planes", figures.planes);
  call("loops", figures.loops);
  call("scan_loops", figures.scan_loops);
  call("joined_planes", figures.joined_planes);
  call("leaning_walls", figures.leaning_walls);
  call("rejected_factors", figures.rejected_factors);
  call("rank_deficiency", figures.rank_deficiency);
  call("cells_free", figures.cells_free);
  call("cells_step_open", figures.cells_step_open);
  call("images_show_no_floor", figures.images_show_no_floor);
  for_each_motion(figures, call);
  for_each_sensor(figures, call);
}

}  // namespace

std::map<std::string, double> by_name(const Figures& figures) {
  std::map<std::string, double> named;
  for_each(figures, [&](const std::string& name, const Figure& figure) {
    if (figure.known()) named[name] = figure;
  });
  return named;
}

Figures figures_of(const std::map<std::string, double>& named) {
  Figures figures;
  for_each(figures, [&](const std::string& name, Figure& figure) {
    if (const auto found = named.find(name); found != named.end()) figure = found->second;
  });
  return figures;
}

void add(Figures& to, const Figures& more) {
  const std::map<std::string, double> named = by_name(more);
  for_each(to, [&](const std::string& name, Figure& figure) {
    if (const auto found = named.find(name); found != named.end()) figure += found->second;
  });
}

}  // namespace lamina::io
