// A simulated robot's measurements as messages of a bag.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <lamina/sensors/measurement.hpp>
#include <lamina/sensors/readers/bag_sink.hpp>

namespace lamina::sim {

/// What a dataset is written as; the truth and calibration.yaml are files of a folder in any case.
enum class DatasetFormat { kFolder, kBag, kDb3, kMcap };
/// By its name ("folder", "bag", "db3", "mcap"); throws lamina::Error for another.
DatasetFormat dataset_format(const std::string& name);

/// Where the recording of a dataset in `folder` goes: recording.bag, or the ROS 2 folder recording.
std::unique_ptr<bag::Sink> make_dataset_sink(const std::filesystem::path& folder,
                                             DatasetFormat format);

/// Topics /scan, /camera/depth/image_raw with camera_info, /odom, /imu, /tf, /tf_static; numbers
/// are rounded as those of a dataset folder are, so that both hold the same robot: but angles of
/// beams are floats, and depth is in millimetres.
class BagWriter {
 public:
  BagWriter(std::unique_ptr<bag::Sink> sink, const Calibration& calibration);

  void write(const DepthFrame& frame);
  void write(const LaserScan& scan);
  void write(const Odometry& odometry);
  void write(const Accelerometer& sample);
  void close() { sink_->close(); }

 private:
  void begin(Timestamp first);

  std::unique_ptr<bag::Sink> sink_;
  Calibration calibration_;
  bool begun_ = false;
};

}  // namespace lamina::sim
