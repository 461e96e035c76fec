// A build without what messages of ROS 2 are written with.
#include <lamina/models/error.hpp>
#include <lamina/pipeline/publish/published_run.hpp>

namespace lamina {

publish::MapPublisher::~MapPublisher() = default;

PublishedRun::PublishedRun(RecordingSource& source, MapOptions&, double rate, RunObserver& observer)
    : observer_(observer), live_(source.live), rate_(rate) {
  throw Error("--publish: found a build without ROS 2, expected one with libfastcdr-dev");
}
void PublishedRun::finished(const MapResult&) {}
void PublishedRun::wait_for(Timestamp) {}
void PublishedRun::on_mapped(const Step&, const Mapper&, const Diagnostics&) {}

}  // namespace lamina
