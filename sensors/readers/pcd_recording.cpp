// Point clouds in .pcd files: one, or a folder of them in name order.
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <algorithm>

#include <lamina/models/error.hpp>
#include <lamina/sensors/calibration_overlay.hpp>
#include <lamina/sensors/readers/pcd_header.hpp>
#include <lamina/sensors/readers/recording_sources.hpp>
#include <lamina/sensors/skip_counts.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {
constexpr double kAssumedPeriod = 0.1;  // s, where names are no times

class PcdRecording final : public Recording {
 public:
  PcdRecording(const std::filesystem::path& path, const RecordingOptions& options)
      : single_(!std::filesystem::is_directory(path)) {
    // PCL speaks on the program's own streams of clouds without a plane; what is wrong is said
    // here.
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
    CalibrationOverlay(options.calibration).apply(calibration_);
    if (single_) files_.push_back(path);
    if (!single_) {
      for (const auto& entry : std::filesystem::directory_iterator(path)) {
        if (entry.path().extension() == ".pcd") files_.push_back(entry.path());
      }
      std::sort(files_.begin(), files_.end());
    }
    name_ = path.string();
    choose_stamps();
  }

  std::optional<Measurement> next() override {
    while (position_ < files_.size()) {
      const std::size_t i = position_++;
      auto frame = read(files_[i]);
      if (!frame) continue;
      frame->stamp = stamps_[i];
      ++given_;
      return *std::move(frame);
    }
    if (given_ == 0) {
      throw input_error(name_, "", std::to_string(files_.size()) + " unreadable clouds",
                        "at least one .pcd with points");
    }
    return std::nullopt;
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return skips_.counts(); }
  std::vector<std::string> remarks() const override { return remarks_; }
  std::optional<std::int64_t> size_hint() const override {
    return static_cast<std::int64_t>(files_.size());
  }

 private:
  // File names that are increasing decimal seconds are times; otherwise clouds are 0.1 s apart.
  void choose_stamps() {
    bool named = true;
    for (const auto& file : files_) {
      const auto stamp = Timestamp::parse(file.stem().string());
      named = named && stamp && (stamps_.empty() || stamps_.back() < *stamp);
      if (!named) break;
      stamps_.push_back(*stamp);
    }
    if (named) return;
    stamps_.clear();
    for (std::size_t i = 0; i < files_.size(); ++i) {
      stamps_.push_back(Timestamp() + kAssumedPeriod * static_cast<double>(i));
    }
    if (!single_) remarks_.emplace_back("names are no times: clouds are taken as 0.1 s apart");
  }

  // A damaged file of many is counted; the only one is an error with its reason.
  std::optional<CloudFrame> read(const std::filesystem::path& file) {
    try {
      const PcdHeader header = check_pcd(read_file_bytes(file), file.string());
      pcl::PointCloud<pcl::PointXYZ> cloud;
      Eigen::Vector4f origin;
      Eigen::Quaternionf orientation;
      pcl::PCLPointCloud2 blob;
      int version = 0;
      const int status = pcl::PCDReader().read(file.string(), blob, origin, orientation, version);
      if (status < 0) {
        throw input_error(file.string(), "", "data that do not fit the header", "a .pcd file");
      }
      pcl::fromPCLPointCloud2(blob, cloud);
      LAMINA_CHECK(static_cast<std::int64_t>(cloud.size()) == header.points);
      CloudFrame frame;
      frame.width = static_cast<int>(cloud.width);
      frame.height = static_cast<int>(cloud.height);
      frame.points_sensor.reserve(cloud.size());
      for (const auto& p : cloud) frame.points_sensor.emplace_back(p.x, p.y, p.z);
      const double norm = static_cast<double>(orientation.norm());
      const bool placed = std::abs(norm - 1) < 0.1 && origin.allFinite();
      if (placed) {
        frame.T_body_sensor =
            SE3(SO3(orientation.cast<double>().normalized()), origin.head<3>().cast<double>());
      }
      return frame;
    } catch (const Error&) {
      if (single_) throw;
      skips_.add("damaged cloud");
    } catch (const std::exception& error) {
      if (single_) throw input_error(file.string(), "", error.what(), "a .pcd file");
      skips_.add("damaged cloud");
    }
    return std::nullopt;
  }

  bool single_;
  std::string name_;
  std::vector<std::filesystem::path> files_;
  std::vector<Timestamp> stamps_;
  std::size_t position_ = 0;
  std::int64_t given_ = 0;
  Calibration calibration_;
  SkipCounts skips_;
  std::vector<std::string> remarks_;
};
}  // namespace

std::unique_ptr<Recording> open_pcd(const std::filesystem::path& path,
                                    const RecordingOptions& options) {
  return std::make_unique<PcdRecording>(path, options);
}

}  // namespace lamina
