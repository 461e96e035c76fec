// Transforms at once, everything else when there is time.
#include <lamina/pipeline/publish/map_publisher.hpp>

#include <chrono>

#include <lamina/grid/evidence/ground_surfaces.hpp>
#include <lamina/grid/evidence/occupancy_builder.hpp>
#include <lamina/models/error.hpp>

namespace lamina::publish {
namespace {

constexpr const char *kMap = "/map", *kUpdates = "/map_updates", *kTf = "/tf",
                     *kScan = "/scan_combined", *kPath = "/lamina/path",
                     *kPlanes = "/lamina/planes", *kSurfels = "/lamina/surfels",
                     *kEdges = "/lamina/edges";

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// What is one state is kept for those who come late; what flows is not.
void advertise_all(dds::Wire& wire) {
  const dds::Qos state{true, true, 1}, flow{true, false, 100};
  const struct {
    const char *topic, *type;
    dds::Qos qos;
  } all[] = {{kMap, "nav_msgs/msg/OccupancyGrid", state},
             {kUpdates, "map_msgs/msg/OccupancyGridUpdate", flow},
             {kTf, "tf2_msgs/msg/TFMessage", flow},
             {kScan, "sensor_msgs/msg/LaserScan", {true, false, 5}},
             {kPath, "nav_msgs/msg/Path", state},
             {kPlanes, "visualization_msgs/msg/MarkerArray", state},
             {kSurfels, "visualization_msgs/msg/MarkerArray", state},
             {kEdges, "sensor_msgs/msg/PointCloud2", state}};
  for (const auto& one : all)
    if (!wire.advertise(one.topic, one.type, one.qos))
      throw Error(std::string("--publish: found no way to open ") + one.topic +
                  ", expected one: does another program publish it with another type?");
}

}  // namespace

MapPublisher::MapPublisher(std::unique_ptr<dds::Wire> wire, const PublishOptions& options)
    : options_(options), wire_(std::move(wire)) {
  advertise_all(*wire_);
  thread_ = std::thread([this] { run(); });
}

MapPublisher::~MapPublisher() { stop(); }

void MapPublisher::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  news_.notify_all();
  if (thread_.joinable()) thread_.join();
}

// Without odometry the body stands in the map itself. Where odometry pauses, the body has a parent:
// it gets no second one.
void MapPublisher::send_transform(Timestamp stamp, const SE3& T_map_body) {
  const auto T_odom_body = odometry_->at(stamp);
  const Header in_map{stamp + options_.tf_ahead, options_.map_frame};
  if (!T_odom_body) {
    if (!odometry_->empty()) return;
    wire_->write(kTf, transform_message(T_map_body, options_.body_frame, in_map));
    return;
  }
  wire_->write(
      kTf, transform_message(T_map_body * T_odom_body->inverse(), options_.odometry_frame, in_map));
  if (!options_.robot)
    wire_->write(kTf, transform_message(*T_odom_body, options_.body_frame,
                                        {stamp, options_.odometry_frame}));
}

void MapPublisher::send_scan(const KeptScan& kept, const SE3& T_start_body) {
  const auto kind = kept.from_depth ? CombinedScan::Kind::kDepth : CombinedScan::Kind::kLidar;
  wire_->write(kScan,
               scan_message(combined_.add(kept.scan, kind, T_start_body), options_.body_frame));
}

void MapPublisher::mapped(const Step& step, const SE3& T_map_body,
                          const std::function<PlanarMap()>& map) {
  send_transform(step.observations.stamp, T_map_body);
  std::vector<KeptScan> scans;
  if (step.scan) scans.push_back({*step.scan, false});
  if (step.obstacles) {
    scans.push_back({step.obstacles->to_laser_scan(), true});
    scans.back().scan.lidar.T_body_lidar = step.T_body_levelled;
    next_task_->obstacles.push_back({*step.obstacles, step.T_body_levelled});
  }
  for (KeptScan& scan : scans) {
    send_scan(scan, step.T_start_body);
    next_task_->scans.push_back(std::move(scan));
  }
  if (now() < next_) return;
  {
    const std::lock_guard lock(mutex_);
    if (!idle_) return;
    idle_ = false;
    next_ = now() + std::max(options_.period, cost_ / options_.share);
  }
  next_task_->map = map();
  {
    const std::lock_guard lock(mutex_);
    task_ = std::move(next_task_);
  }
  next_task_ = std::make_unique<Task>();
  news_.notify_all();
}

void MapPublisher::send_map(const PlanarMap& map) {
  if (map.trajectory.empty()) return;
  const Header header{map.trajectory.back().stamp, options_.map_frame};
  wire_->write(kPath, path_message(map.trajectory, header));
  wire_->write(kPlanes, planes_message(map.planes, header));
  wire_->write(kSurfels, surfels_message(map.surfels, header));
  wire_->write(kEdges, edges_message(map.edges, header));
}

// A grid that grew goes as a whole, one that changed as what changed.
void MapPublisher::send_grid(const OccupancyGrid& grid, Timestamp stamp) {
  GridCells cells = cells_of(grid);
  const Header header{stamp, options_.map_frame};
  const bool same = sent_ && sent_->width == cells.width && sent_->height == cells.height &&
                    sent_->x == cells.x && sent_->y == cells.y;
  if (same) {
    const CellRange changed = changed_cells(*sent_, cells);
    if (changed.width == 0) return;
    wire_->write(kUpdates, grid_update_message(cells, changed, header));
  }
  // Whoever comes late gets the whole.
  wire_->write(kMap, grid_message(cells, header));
  sent_ = std::move(cells);
}

void MapPublisher::make_and_send(Task& task) {
  for (KeptScan& scan : task.scans) scans_.push_back(std::move(scan));
  for (const SeenObstacles& seen : task.obstacles) rims_.add(seen.scan, seen.T_body_levelled);
  const Trajectory& path = task.map.trajectory;
  task.map.edges = rims_.rims(path, options_.grid.resolution);
  send_map(task.map);
  const auto scans = [this](const std::function<void(const KeptScan&)>& take) {
    for (const KeptScan& scan : scans_) take(scan);
  };
  const ScanOccupancy seen =
      occupancy_of_scans(scans, path, GroundHits(task.map.planes), options_.grid);
  if (seen.grid) send_grid(*seen.grid, path.back().stamp);
}

void MapPublisher::run() {
  while (true) {
    std::unique_ptr<Task> task;
    {
      std::unique_lock lock(mutex_);
      news_.wait(lock, [this] { return stop_ || task_; });
      if (stop_) return;
      task = std::move(task_);
    }
    const double begin = now();
    make_and_send(*task);
    const std::lock_guard lock(mutex_);
    cost_ = now() - begin;
    idle_ = true;
  }
}

void MapPublisher::finish(const PlanarMap& map, const OccupancyGrid* grid) {
  stop();
  send_map(map);
  if (grid != nullptr && !map.trajectory.empty()) send_grid(*grid, map.trajectory.back().stamp);
  wire_->flush(1);
}

}  // namespace lamina::publish
