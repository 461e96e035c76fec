// A map sent to ROS 2 while it grows.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <lamina/frontend/frontend.hpp>
#include <lamina/grid/evidence/negative_obstacles.hpp>
#include <lamina/grid/evidence/scan_fusion.hpp>
#include <lamina/pipeline/map_options.hpp>
#include <lamina/pipeline/publish/map_messages.hpp>
#include <lamina/pipeline/publish/odometry_poses.hpp>
#include <lamina/sensors/dds/wire.hpp>

namespace lamina::publish {

struct PublishOptions {
  double period = 2;     ///< s from one grid, planes, path to the next, at least
  double share = 0.1;    ///< of a processor's time that these may take
  double tf_ahead = 0.2; /**< s that map -> odom is stamped ahead: it holds until the next, and
                            those who ask for it at the newest odometry get an answer */
  std::string map_frame = "map", odometry_frame = "odom", body_frame = "base_link";
  bool robot = false;  ///< it publishes its own odometry -> body; else that is published, too
  GridOptions grid;
};

/// Topics: /map, /map_updates, /tf, /scan_combined, /lamina/path, /lamina/planes,
/// /lamina/surfels, /lamina/edges. The transform goes at once, from the caller's thread; what takes
/// longer is made in a thread of its own.
class MapPublisher {
 public:
  /// Throws lamina::Error where a topic cannot be opened.
  MapPublisher(std::unique_ptr<dds::Wire> wire, const PublishOptions& options);
  ~MapPublisher();
  MapPublisher(const MapPublisher&) = delete;
  MapPublisher& operator=(const MapPublisher&) = delete;

  /// Where odometry goes that is read.
  const std::shared_ptr<OdometryPoses>& odometry() const { return odometry_; }
  /// A step that was mapped, with the body's pose there; `map` is called where it is time for all
  /// the rest.
  void mapped(const Step& step, const SE3& T_map_body, const std::function<PlanarMap()>& map);
  /// The last map, as it is written; waits until subscribers have it, a second at most. `grid` may
  /// be null.
  void finish(const PlanarMap& map, const OccupancyGrid* grid);

 private:
  struct SeenObstacles {
    ObstacleScan scan;
    SE3 T_body_levelled;
  };
  struct Task {
    PlanarMap map;
    std::vector<KeptScan> scans;  // since the last
    std::vector<SeenObstacles> obstacles;
  };
  void make_and_send(Task& task);
  void send_transform(Timestamp stamp, const SE3& T_map_body);
  void send_scan(const KeptScan& scan, const SE3& T_start_body);
  void send_map(const PlanarMap& map);
  void send_grid(const OccupancyGrid& grid, Timestamp stamp);
  void run();
  void stop();

  PublishOptions options_;
  std::shared_ptr<OdometryPoses> odometry_ = std::make_shared<OdometryPoses>();
  CombinedScan combined_;
  std::unique_ptr<Task> next_task_ = std::make_unique<Task>();  // of the caller's thread
  double next_ = 0;                                             // s, steady

  std::mutex mutex_;
  std::condition_variable news_;
  std::unique_ptr<Task> task_;
  bool idle_ = true, stop_ = false;
  double cost_ = 0;  // s of the last

  std::vector<KeptScan> scans_;  // of the thread, as rims_
  RimVotes rims_;
  std::optional<GridCells> sent_;
  std::unique_ptr<dds::Wire> wire_;
  std::thread thread_;
};

}  // namespace lamina::publish
