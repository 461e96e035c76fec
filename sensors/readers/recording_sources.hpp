// The readers behind open_recording(), one function each.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <lamina/sensors/readers/bag_messages.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

std::unique_ptr<Recording> open_dataset_folder(const std::filesystem::path& folder,
                                               const RecordingOptions& options);
std::unique_ptr<Recording> open_carmen_log(const std::filesystem::path& file,
                                           const RecordingOptions& options);
/// The same from a text in memory; `name` stands in messages.
std::unique_ptr<Recording> open_carmen_text(std::string text, const std::string& name,
                                            const RecordingOptions& options);
std::unique_ptr<Recording> open_rawlog(const std::filesystem::path& file,
                                       const RecordingOptions& options);
std::unique_ptr<Recording> open_rosbag(const std::filesystem::path& file,
                                       const RecordingOptions& options);
/// The messages of open_rosbag().
std::unique_ptr<bag::Source> open_rosbag_messages(const std::string& name);
/// A .db3 or .mcap, also as .zstd, or a folder of them with or without metadata.yaml.
std::unique_ptr<Recording> open_ros2(const std::filesystem::path& path,
                                     const RecordingOptions& options);
/// The messages of open_ros2().
std::unique_ptr<bag::Source> open_ros2_messages(const std::filesystem::path& path);
/// `ros2:` or `ros2:DOMAIN`: a running robot.
std::unique_ptr<Recording> open_ros2_live(const std::string& input,
                                          const RecordingOptions& options);
/// `uri` is a file (.oni), a device's URI, or empty for any device.
std::unique_ptr<Recording> open_openni(const std::string& uri, bool is_file,
                                       const RecordingOptions& options);
/// One .pcd, or all of a folder in name order.
std::unique_ptr<Recording> open_pcd(const std::filesystem::path& path,
                                    const RecordingOptions& options);

}  // namespace lamina
