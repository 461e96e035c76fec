// Blocks, then one step in each series.
#include <lamina/pipeline/calibration/sensor_changes.hpp>

#include <fmt/format.h>

#include <cmath>

#include <lamina/models/median.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

}  // namespace

void SensorChanges::Series::close() {
  medians.push_back(median(std::move(block)));
  block.clear();
}

void SensorChanges::add(const Step& step) {
  if (step.obstacles) add_camera(step);
  if (step.scan_motion) add_ways(step);
}

void SensorChanges::add_camera(const Step& step) {
  const Timestamp stamp = step.observations.stamp;
  if (camera_block_ && stamp - *camera_block_ >= options_.block) {
    for (Series* series : {&roll_, &pitch_, &height_}) series->close();
    camera_block_.reset();
  }
  if (!camera_block_) {
    camera_block_ = stamp;
    for (Series* series : {&roll_, &pitch_, &height_}) series->from.push_back(stamp);
  }
  const SE3 T_levelled_camera = step.T_body_levelled.inverse() * step.observations.T_body_sensor;
  const Eigen::Vector3d turned = step.T_body_levelled.so3().log();
  roll_.block.push_back(turned.x());
  pitch_.block.push_back(turned.y());
  height_.block.push_back(T_levelled_camera.translation().z());
}

void SensorChanges::add_ways(const Step& step) {
  const bool tracked = step.scan_motion->status == ScanMotion::Status::kTracked;
  if (!step.wheels_moved || !tracked || step.tracking_lost) {
    piece_ = {};
    return;
  }
  piece_.add(*step.wheels_moved, step.scan_motion->T_prev_curr_body);
  if (!is_whole(piece_)) return;
  if (const auto lengths = lengths_of(piece_)) {
    if (!way_block_) {
      way_block_ = step.observations.stamp;
      ratio_.from.push_back(*way_block_);
    }
    ratio_.block.push_back(lengths->scans / lengths->wheels);
    way_ += lengths->wheels;
    if (way_ >= options_.way) {
      ratio_.close();
      way_block_.reset();
      way_ = 0;
    }
  }
  piece_ = {};
}

std::vector<Warning> SensorChanges::warnings() const {
  std::vector<Warning> all;
  std::string camera;
  const auto look = [&](const Series& series, double least, const char* what, double unit,
                        const char* unit_name) {
    const auto found = find_step(series.medians, options_.step);
    if (!found || !(std::abs(found->after - found->before) >= least)) return;
    camera += fmt::format(
        "{}its {} over the floor it sees goes from {:.2f} to {:.2f} {} at about "
        "{} s",
        camera.empty() ? "" : ", ", what, found->before / unit, found->after / unit, unit_name,
        series.from[found->at].to_string());
  };
  look(roll_, options_.least_tilt, "roll", kDegree, "degrees");
  look(pitch_, options_.least_tilt, "pitch", kDegree, "degrees");
  const double height = height_.medians.empty() ? 0 : std::abs(height_.medians.front());
  look(height_, options_.least_height * height, "height", 1, "m");
  if (!camera.empty()) {
    all.push_back(
        {"camera_changes", "the camera does not stay as it is: " + camera +
                               " (knocked, or its depth in another unit from there on). What self-"
                               "calibration found holds for neither part: map them one by one"});
  }
  const auto ways = find_step(ratio_.medians, options_.step);
  if (ways && std::abs(ways->after - ways->before) >= options_.least_ratio) {
    all.push_back(
        {"ranges_change",
         fmt::format("scans tell {:.3f} times the way that wheels tell up to {} s, {:.3f} "
                     "times after it: ranges of the scanner, or wheels, have another "
                     "scale from there on, and so has the map",
                     ways->before, ratio_.from[ways->at].to_string(), ways->after)});
  }
  return all;
}

}  // namespace lamina
