// The table itself: keys, members, meanings.
#include <algorithm>
#include <array>
#include <string>

#include <lamina/pipeline/config/preset.hpp>
#include <lamina/pipeline/config/setting_ranges.hpp>
#include <lamina/pipeline/config/settings.hpp>

namespace lamina {
namespace {

// Keeps the rows short: s.MEMBER by reference.
#define LAMINA_ROW(key, member, comment) \
  row(                                   \
      key, [](MapOptions & s) -> auto& { return s.member; }, comment)
#define LAMINA_ROW_DEG(key, member, comment) \
  row_deg(                                   \
      key, [](MapOptions & s) -> auto& { return s.member; }, comment)

// One switch for all that a recording may correct of its sensors: off, it switches off each of
// them; on, each is as its own setting says.
Setting self_calibration_row() {
  const auto all = [](auto& s) {
    return std::array{&s.find_clocks,      &s.find_sweep,          &s.calibrate_depth,
                      &s.calibrate_wheels, &s.calibrate_mountings, &s.floor.self_calibrate};
  };
  return {"self_calibration.enabled",
          "correct by the recording what is stated of its sensors: scan duration, clocks, wheels, "
          "extrinsics, lens, focal length; false: lidar.find_sweep, clocks.find, depth.calibrate, "
          "wheels.calibrate, mountings.calibrate and floor.self_calibrate are all false",
          [all](const MapOptions& s) {
            const auto flags = all(s);
            return text::write(
                std::any_of(flags.begin(), flags.end(), [](const bool* on) { return *on; }));
          },
          [all](MapOptions& s, const std::string& from) {
            bool on = true;
            text::read(from, on);
            if (on) return;
            for (bool* flag : all(s)) *flag = false;
          }};
}

std::vector<Setting> general_rows() {
  return {
      LAMINA_ROW("preset", preset,
                 "values to begin with: indoor_rgbd, wheeled_lidar, aerial_lidar, or auto: what "
                 "the recording's sensors suggest; all other keys go over it"),
      LAMINA_ROW("seed", seed, "seed of everything random; the same seed gives the same bytes"),
      LAMINA_ROW("threads", threads, "threads to use; results do not depend on it"),
      LAMINA_ROW("checkpoint.interval_s", checkpoint_interval,
                 "s between saved states of a run; 0.2 is allowed"),
      LAMINA_ROW("grid.resolution_m", grid_resolution, "m, side of a cell of the grids"),
      LAMINA_ROW("robot.height_m", robot.height,
                 "m, of the robot with its sensors: what is above does not block"),
      LAMINA_ROW("robot.radius_m", robot.radius, "m, of the circle that holds its outline"),
      LAMINA_ROW("robot.max_step_m", robot.max_step, "m, largest step its wheels climb"),
      LAMINA_ROW_DEG("robot.max_slope_deg", robot.max_slope, "degrees, steepest slope it drives"),
      self_calibration_row(),
      LAMINA_ROW("lidar.range_sigma", stated_scanner.range_sigma,
                 "m, 1-sigma of a scanner's range; 0: as the recording says"),
      LAMINA_ROW_DEG("lidar.field_of_view_deg", stated_scanner.field_of_view,
                     "degrees from a scan's first beam to its last, about the middle of what the "
                     "recording states; 0: as the recording says"),
      LAMINA_ROW(
          "lidar.sweep_s", sweep,
          "s from a scan's first beam to its last where the recording does not say (ROS bags "
          "do): scans are straightened by the motion in that time; negative: the last beam comes "
          "first; 0: all beams at once, or found (lidar.find_sweep)"),
      LAMINA_ROW("lidar.find_sweep", find_sweep,
                 "turns tell the sweep where neither recording nor setting do; online once there "
                 "were enough"),
      row_enum(
          "lidar.no_return_is_free", [](MapOptions & s) -> auto& { return s.no_return_is_free; },
          {"auto", "true", "false"},
          "whether beams without return clear the occupancy grid up to the scanner's range_max "
          "(REP 117: inf); auto: where it returns from things that far, and they do not go through "
          "walls"),
      row_enum(
          "lidar.partial_view", [](MapOptions & s) -> auto& { return s.mapper.partial_view; },
          {"moments", "end_points"},
          "what a scan's segment says of its plane: moments of its returns, or the constraint of "
          "the article on planes from a 2D lidar (rotation between segment and plane, mean "
          "distance of its end points, whitened by the fit with its uncertain ends)"),
      LAMINA_ROW("lidar.delay_s", scanner_delay,
                 "s that scans' stamps are late by: taken off them"),
      LAMINA_ROW("camera.delay_s", camera_delay, "likewise, of images and clouds"),
      LAMINA_ROW("odometry.delay_s", odometry_delay, "likewise, of odometry"),
      LAMINA_ROW("clocks.find", find_clocks,
                 "with planar odometry, offline: turns tell further delays of scanner, camera and "
                 "wheels, which are taken off, too"),
      LAMINA_ROW("topics.scan", topics["scan"],
                 "topic of a ROS bag to take as scans; \"\": the one of that type"),
      LAMINA_ROW("topics.depth", topics["depth"], "likewise, depth images"),
      LAMINA_ROW("topics.odom", topics["odom"], "likewise, odometry"),
      LAMINA_ROW("topics.cloud", topics["cloud"],
                 "likewise, point clouds; \"\": taken only where there are no scans and no images"),
      LAMINA_ROW("topics.cloud_slice", topics["cloud_slice"],
                 "LOW,HIGH in m above the floor: the clouds become scans of what stands between"),
  };
}

std::vector<Setting> floor_rows() {
  return {
      LAMINA_ROW("floor.sections", floor.sections, "sub-sections of the region, along x and y"),
      LAMINA_ROW("floor.roi_m", floor.roi_m,
                 "m, region of interest: length ahead, width, height above the floor"),
      LAMINA_ROW("floor.time_budget_ms", floor.time_budget_ms,
                 "ms, 0: none; else the farthest sections are left out"),
      LAMINA_ROW("floor.recursion_limit", floor.recursion_limit, "planes a sub-section may give"),
      LAMINA_ROW("floor.hypotheses", floor.hypotheses, "samples a RANSAC step tries"),
      LAMINA_ROW("floor.distance_sigmas", floor.distance_sigmas,
                 "distance threshold, in sigmas of the sensor at that range"),
      LAMINA_ROW("floor.prior_cone_deg", floor.prior_cone_deg,
                 "degrees about the last floor's normal in which the next is looked for"),
      LAMINA_ROW("floor.self_calibrate", floor.self_calibrate,
                 "correct the camera's pitch, roll and height by the floor it sees"),
      LAMINA_ROW("floor.false_alarm", floor.false_alarm,
                 "share of flat floor cells that may be called raised or lowered"),
      LAMINA_ROW("floor.surfel_m", floor.surfel_m, "m, side of the patch a surfel stands for"),
  };
}

std::vector<Setting> scan_rows() {
  return {
      row_enum(
          "obstacles.method", [](MapOptions & s) -> auto& { return s.scan.method; },
          {"contiguous_floor", "document"},
          "how holes are found: contiguous_floor, walking out over the fitted floor, or document, "
          "the two methods of the document on negative obstacles as written, to compare"),
      LAMINA_ROW("obstacles.leveled", scan.leveled,
                 "level by the floor of each image; false: the mounting as calibrated"),
      LAMINA_ROW("obstacles.angle_increment_deg", scan.angle_increment_deg,
                 "degrees between beams; 0: what a pixel in the middle of the image spans"),
      LAMINA_ROW("obstacles.range_max_m", scan.range_max_m, "m; 0: the range of the camera"),
      LAMINA_ROW("obstacles.min_hole_depth_m", scan.min_hole_depth_m,
                 "m; shallower is no hole to any wheel"),
      LAMINA_ROW("obstacles.obstacles_beyond_knowledge", scan.obstacles_beyond_knowledge,
                 "keep walls behind ground that nobody saw; else such beams have no return"),
      LAMINA_ROW("obstacles.noise_sigmas", scan.noise_sigmas,
                 "sigmas of one pixel beyond which it lies off the floor"),
      LAMINA_ROW("obstacles.grazing_deg", scan.grazing_deg,
                 "degrees of incidence beyond which the sensor loses a floor"),
  };
}

std::vector<Setting> segment_rows() {
  return {
      LAMINA_ROW("segments.min_points", segments.min_points, "returns a segment must have"),
      LAMINA_ROW("segments.min_length_m", segments.min_length,
                 "m; shorter pieces are loose points"),
      LAMINA_ROW("segments.max_bridge_m", segments.max_bridge,
                 "m; collinear pieces are joined over a shadow this long"),
      LAMINA_ROW("tracking.gate", tracking.gate, "chi-squared of collinearity, 2 degrees"),
      LAMINA_ROW("tracking.min_observations", tracking.min_observations,
                 "scans that must have seen a track before it counts"),
      LAMINA_ROW("tracking.max_coast_s", tracking.max_coast_s,
                 "s without a sighting after which a track ends"),
      LAMINA_ROW("scan_odometry.key_scans", scan_odometry.key_scans,
                 "key scans in the local map that scans are matched with"),
      LAMINA_ROW("scan_odometry.map_radius_m", scan_odometry.map_radius,
                 "m; key scans farther away leave the local map"),
      LAMINA_ROW("loops.enabled", close_loops, "look for places met again by matching scans"),
      LAMINA_ROW("loops.submap_length_m", loops.submap_length, "m travelled in a submap"),
      LAMINA_ROW("loops.max_window_m", loops.max_window, "m, largest search for an old place"),
      LAMINA_ROW("loops.min_score", loops.min_score, "least mean likelihood of a match, 0 to 1"),
      LAMINA_ROW("loops.max_ambiguity", loops.max_ambiguity,
                 "second best place against the best; above, no loop is closed"),
      LAMINA_ROW(
          "depth.calibrate", calibrate_depth,
          "offline: planes tell the slow bend of depth images, maps its slopes and the focal "
          "length; all are taken out"),
      LAMINA_ROW(
          "mountings.calibrate", calibrate_mountings,
          "offline: ground, travel, turns and shared walls correct how scanner and camera sit"),
      LAMINA_ROW("mountings.sigma_heading_deg", mounting_sigma_heading_deg,
                 "1-sigma of stated headings of sensors: in planes' sigmas, nowhere else"),
      LAMINA_ROW("mountings.sigma_place_m", mounting_sigma_place_m,
                 "m; 1-sigma of their stated places across the floor, likewise"),
      LAMINA_ROW("refine.extrinsics", refine_extrinsics,
                 "offline, and by `refine`: estimate where each sensor sits, all six numbers, "
                 "together with poses and planes; adopted where that lowers the whole"),
      LAMINA_ROW("wheels.calibrate", calibrate_wheels,
                 "a first look by scans tells the wheels' scale, without scans a first map of "
                 "images scale "
                 "and drift; on the way scans go on to tell them"),
      LAMINA_ROW("depth_odometry.enabled", images_beside_wheels,
                 "without a scanner: depth images tell motions better than wheels, which may slip"),
      LAMINA_ROW("slopes.follow", follow_slopes,
                 "images tell height and tilt of the body where they show the ground change slope"),
  };
}

std::vector<Setting> window_rows() {
  return {
      row_enum(
          "solver.engine", [](MapOptions & s) -> auto& { return s.mapper.window.engine; },
          {"native", "ceres"},
          "who solves the graph: the own block Cholesky, or Ceres; time "
          "depends on it, results to the last digits and where a path is off by radians"),
      LAMINA_ROW("window.keyframes", mapper.window.keyframes, "keyframes kept as variables"),
      LAMINA_ROW("window.dormant_planes", mapper.window.planes_behind,
                 "planes that left and come back as if they had stayed, at most; time goes with "
                 "the square"),
      LAMINA_ROW("window.seconds", mapper.window.seconds, "s kept as variables; 0: by number"),
      LAMINA_ROW("window.iterations", mapper.window.iterations, "solver steps a keyframe"),
      LAMINA_ROW("keyframe.distance_m", mapper.keyframe_distance_m, "m moved: a new keyframe"),
      LAMINA_ROW("keyframe.angle_deg", mapper.keyframe_angle_deg, "degrees turned, likewise"),
      LAMINA_ROW("keyframe.new_share", mapper.keyframe_new_share,
                 "share of observations that match nothing known, likewise"),
  };
}

std::vector<Setting> mapper_rows() {
  return {
      LAMINA_ROW("planes.min_observations", mapper.min_observations,
                 "frames that must have seen a plane before it enters the map"),
      LAMINA_ROW("planes.merge", mapper.merge_planes, "merge planes that turn out to be one"),
      LAMINA_ROW("planes.outline_cell_m", mapper.outline_cell_m, "m, detail of outlines"),
      LAMINA_ROW("planes.prior_tilt_deg", mapper.prior_tilt_deg,
                 "degrees, weak prior that planes of scan segments stand upright on the scan"),
      LAMINA_ROW("association.max_distance_m", mapper.association.max_distance_m,
                 "m between an observation and its plane at most"),
      LAMINA_ROW("association.max_angle_deg", mapper.association.max_angle_deg,
                 "degrees between them at most"),
      LAMINA_ROW("association.max_gap_m", mapper.association.max_gap_m,
                 "m that an observation may lie beyond the plane's outline"),
      LAMINA_ROW("place_recognition.enabled", mapper.place.enabled,
                 "recognise planes met again (loops)"),
      LAMINA_ROW("place_recognition.min_planes", mapper.place.min_planes,
                 "planes that must agree before a recognition is believed"),
  };
}

std::vector<Setting> ground_rows() {
  return {
      LAMINA_ROW("planes.connect_ground", mapper.ground.enabled,
                 "ground that swells is one floor with a roughness; false: a plane for every piece "
                 "that an image cuts it into"),
      LAMINA_ROW("surfels.joint", mapper.joint_surfels.enabled,
                 "estimate surfels of floors that are no planes together with poses and planes; "
                 "false: after them"),
      LAMINA_ROW("surfels.joint_cell_m", mapper.joint_surfels.cell_m, "m, side of such a surfel"),
      LAMINA_ROW("surfels.cell_m", mapper.surfel_cell_m, "m, side of a surfel of the floor"),
      LAMINA_ROW("labels.level_tilt_deg", mapper.labels.level_tilt_deg,
                 "degrees within which a plane is level"),
      LAMINA_ROW("labels.wall_tilt_deg", mapper.labels.wall_tilt_deg,
                 "degrees within which a plane is upright"),
  };
}

#undef LAMINA_ROW
#undef LAMINA_ROW_DEG

}  // namespace

namespace {

// "planes" of "planes.connect_ground".
std::string section(const Setting& setting) { return setting.key.substr(0, setting.key.find('.')); }

// Rows of one section follow each other wherever they are listed: a map's key stands once in YAML.
void gather_sections(std::vector<Setting>& rows) {
  for (auto first = rows.begin(); first != rows.end();) {
    first = std::stable_partition(first, rows.end(), [name = section(*first)](const Setting& row) {
      return section(row) == name;
    });
  }
}

}  // namespace

const std::vector<Setting>& setting_table() {
  static const std::vector<Setting> table = [] {
    std::vector<Setting> rows = general_rows();
    for (auto part :
         {floor_rows(), scan_rows(), segment_rows(), window_rows(), mapper_rows(), ground_rows()}) {
      rows.insert(rows.end(), part.begin(), part.end());
    }
    gather_sections(rows);
    return rows;
  }();
  return table;
}

std::vector<std::string> problems(const MapOptions& settings) {
  std::vector<std::string> all;
  if (settings.preset != "auto" && find_preset(settings.preset) == nullptr) {
    all.push_back("preset: found '" + settings.preset +
                  "', expected auto, indoor_rgbd, wheeled_lidar or aerial_lidar");
  }
  for (const Setting& setting : setting_table()) {
    const std::string value = setting.write(settings);
    try {
      require_in_range(setting.key, value);
    } catch (const std::invalid_argument& expected) {
      all.push_back(setting.key + ": found '" + value + "', expected " + expected.what());
    }
  }
  for (const auto& part :
       {settings.floor.problems(), scan_options(settings).problems(), settings.segments.problems(),
        settings.tracking.problems(), settings.mapper.problems()}) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

}  // namespace lamina
