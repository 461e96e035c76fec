// CameraInfo, checked.
#include <lamina/sensors/readers/bag_camera.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/sensors/intrinsics.hpp>

namespace lamina::bag {
namespace {

void scale_to_images(const std::string& bag, const Message& info, CameraModel& camera,
                     std::vector<Warning>& warnings) {
  const bool stated = info.width > 0 && info.height > 0;  // some drivers leave them out
  if (!stated || (info.width == camera.width && info.height == camera.height)) return;
  const std::string sizes = "is of " + std::to_string(info.width) + " x " +
                            std::to_string(info.height) + " pixels, images have " +
                            std::to_string(camera.width) + " x " + std::to_string(camera.height);
  if (!scale_intrinsics(camera, info.width, info.height)) {
    throw input_error(bag, "topic " + info.topic, "CameraInfo that " + sizes,
                      "that of the images, or a calibration file");
  }
  warnings.push_back({"image_size", "topic " + info.topic + " " + sizes + ": K scaled to these"});
}

void check_intrinsics(const std::string& bag, const Message& info, CameraModel& camera,
                      std::vector<Warning>& warnings) {
  scale_to_images(bag, info, camera, warnings);
  if (const std::string wrong = senseless_intrinsics(camera); !wrong.empty()) {
    throw input_error(bag, "topic " + info.topic, "K with " + wrong,
                      "a field of view from 1 to 170 degrees, or a calibration file");
  }
  if (auto mended = mend_principal_point(camera, "topic " + info.topic)) {
    warnings.push_back(*std::move(mended));
  }
}

}  // namespace

void check_unit(const Message& image, std::vector<Warning>& warnings) {
  if (!image.floats_in_mm) return;
  warnings.push_back({"depth_unit", "topic " + image.topic +
                                        ": values of 32FC1 are metres by [REP118], but hundreds "
                                        "and more here: read as millimetres"});
}

CameraModel camera_of(const std::string& bag, const Message& image, const Message* given,
                      bool stated, std::vector<Warning>& warnings) {
  if (!given && !stated) {
    throw input_error(bag, "topic " + image.topic, "no camera information",
                      "a sensor_msgs/CameraInfo beside it, or a calibration file");
  }
  CameraModel camera;
  camera.width = image.width;
  camera.height = image.height;
  if (!given) return camera;
  const Message& info = *given;
  camera.fx = info.intrinsics[0];
  camera.fy = info.intrinsics[1];
  camera.cx = info.intrinsics[2];
  camera.cy = info.intrinsics[3];
  if (!stated) check_intrinsics(bag, info, camera, warnings);
  const auto& d = info.distortion;
  const bool rectified = image.topic.find("rect") != std::string::npos;
  if (!rectified && d.size() >= 5 && info.distortion_model == "plumb_bob" &&
      std::all_of(d.begin(), d.end(), [](double x) { return std::isfinite(x); }) &&
      std::any_of(d.begin(), d.end(), [](double x) { return x != 0; })) {
    camera.distortion = {d[0], d[1], d[2], d[3], d[4]};
  }
  return camera;
}

}  // namespace lamina::bag
