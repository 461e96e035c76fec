// A publisher beside the observer of a run.
#include <lamina/pipeline/publish/published_run.hpp>

#include <thread>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/sensors/ros2/live_source.hpp>

namespace lamina {

PublishedRun::PublishedRun(RecordingSource& source, MapOptions& options, double rate,
                           RunObserver& observer)
    : observer_(observer), live_(source.live), rate_(rate) {
  publish::PublishOptions how;
  how.robot = ros2::is_live(source.name);
  how.odometry_frame = source.odometry_frame;
  how.body_frame = source.body_frame;
  how.grid = grid_options(options);
  const int domain = how.robot ? ros2::live_domain(source.name) : dds::domain_of_environment();
  publisher_ = std::make_unique<publish::MapPublisher>(dds::open_wire(domain), how);
  source.open = [open = source.open,
                 poses = publisher_->odometry()]() -> std::unique_ptr<Recording> {
    return std::make_unique<publish::NotedOdometry>(open(), poses);
  };
  options.online = true;
}

void PublishedRun::wait_for(Timestamp stamp) {
  using Clock = std::chrono::steady_clock;
  const auto ask = std::chrono::milliseconds(20);  // whether to stop
  if (!first_) {
    first_ = stamp;
    began_ = Clock::now();
  }
  const auto when = began_ + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>((stamp - *first_) / rate_));
  while (Clock::now() < when && !should_stop())
    std::this_thread::sleep_for(std::min<Clock::duration>(ask, when - Clock::now()));
}

void PublishedRun::on_mapped(const Step& step, const Mapper& mapper,
                             const Diagnostics& diagnostics) {
  if (!live_) wait_for(step.observations.stamp);
  publisher_->mapped(step, mapper.current_pose(), [&mapper] { return mapper.map(); });
  observer_.on_mapped(step, mapper, diagnostics);
}

void PublishedRun::finished(const MapResult& result) {
  if (hurried()) return;
  const bool grid = result.grids && result.grids->occupancy;
  publisher_->finish(result.map, grid ? &*result.grids->occupancy : nullptr);
}

}  // namespace lamina
