// Blocks, then one step in each series.
#include <lamina/pipeline/calibration/sensor_changes.hpp>

#include <fmt/format.h>

#include <cmath>

#include <lamina/models/median.hpp>
#include <lamina/pipeline/calibration/floor_below.hpp>

namespace lamina {
void SensorChanges::Series::add(Timestamp stamp, double value, double length) {
  if (from_.empty() || stamp - from_.back() >= length) {
    if (!from_.empty()) medians_.push_back(median(std::move(block_)));
    block_.clear();
    from_.push_back(stamp);
  }
  block_.push_back(value);
}

std::optional<SensorChanges::Series::Found> SensorChanges::Series::step(
    double least, const StepChangeOptions& options) const {
  const auto found = find_step(medians_, options);
  if (!found || std::abs(found->after - found->before) < least) return std::nullopt;
  return Found{*found, from_[found->at]};
}

void SensorChanges::add(const Step& step) {
  if (step.obstacles) add_camera(step);
  if (step.scan_motion) add_ways(step);
}

void SensorChanges::add_camera(const Step& step) {
  if (T_start_image_ &&
      (T_start_image_->inverse() * step.T_start_body).log().norm() < options_.moved)
    return;
  T_start_image_ = step.T_start_body;
  const Timestamp stamp = step.observations.stamp;
  const SE3 T_levelled_camera = step.T_body_levelled.inverse() * step.observations.T_body_sensor;
  const auto floor = floor_below(step, T_levelled_camera.so3(), options_.level);
  floors_.add(stamp, floor ? 1 : 0, options_.block);
  if (!floor) return;
  const Eigen::Vector3d& up = floor->normal();  // in the optical frame: y looks down, z ahead
  roll_.add(stamp, std::atan2(up.x(), -up.y()), options_.block);
  pitch_.add(stamp, std::atan2(-up.z(), -up.y()), options_.block);
  height_.add(stamp, -floor->rho(), options_.block);
}

void SensorChanges::add_ways(const Step& step) {
  const bool tracked = step.scan_motion->status == ScanMotion::Status::kTracked;
  if (!step.wheels_moved || !tracked || step.tracking_lost) {
    piece_ = {};
    return;
  }
  piece_.add(*step.wheels_moved, step.scan_motion->T_prev_curr_body);
  if (!is_whole(piece_)) return;
  if (const auto lengths = lengths_of(piece_))
    ratio_.add(step.observations.stamp, lengths->scans / lengths->wheels, 0);
  piece_ = {};
}

std::vector<Warning> SensorChanges::warnings() const {
  std::string camera;
  const auto look = [&](const Series& series, double least, const char* what, double unit,
                        const char* unit_name) {
    const auto found = series.step(least, options_.step);
    if (!found) return;
    camera += fmt::format("{}its {} goes from {:.2f} to {:.2f}{} at about {} s",
                          camera.empty() ? "" : ", ", what, found->change.before / unit,
                          found->change.after / unit, unit_name, found->at.to_string());
  };
  look(roll_, options_.least_tilt, "roll over the floor it sees", M_PI / 180, " degrees");
  look(pitch_, options_.least_tilt, "pitch over the floor it sees", M_PI / 180, " degrees");
  const double height = height_.medians().empty() ? 0 : std::abs(height_.medians().front());
  look(height_, options_.least_height * height, "height over the floor it sees", 1, " m");
  // That it shows one at last is no fault.
  const auto floors = floors_.step(options_.least_share, options_.step);
  if (floors && floors->change.after < floors->change.before)
    look(floors_, options_.least_share, "share of images with a floor", 1, "");
  std::vector<Warning> all;
  if (!camera.empty()) {
    all.push_back({"camera_changes",
                   "the camera does not stay as it is: " + camera +
                       " (knocked, covered, or its depth in another unit from there on). What "
                       "self-calibration found holds for neither part: map them one by one"});
  }
  if (const auto found = ratio_.step(options_.least_ratio, options_.step)) {
    all.push_back(
        {"ranges_change",
         fmt::format("scans tell {:.3f} times the way that wheels tell up to {} s, {:.3f} "
                     "times after it: ranges of the scanner, or wheels, have another "
                     "scale from there on, and so has the map",
                     found->change.before, found->at.to_string(), found->change.after)});
  }
  return all;
}

}  // namespace lamina
