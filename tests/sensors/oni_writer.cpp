// Records the simulated camera to an .oni file through the stock recorder.
#include "sensors/oni_writer.hpp"

#include <OpenNI.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

namespace lamina::test {
namespace {
struct LastIndex : openni::VideoStream::NewFrameListener {
  std::atomic<int> last{0};
  void onNewFrame(openni::VideoStream& stream) override {
    openni::VideoFrameRef frame;
    if (stream.readFrame(&frame) == openni::STATUS_OK) last = frame.getFrameIndex();
  }
};

void demand(openni::Status status, const char* what) {
  if (status != openni::STATUS_OK) {
    throw std::runtime_error(std::string(what) + ": " + openni::OpenNI::getExtendedError());
  }
}
}  // namespace

void record_simulated_oni(const std::string& uri, const std::string& file, int frames) {
  demand(openni::OpenNI::initialize(), "initialize");
  {
    openni::Device device;
    demand(device.open(uri.c_str()), "open");
    openni::VideoStream stream;
    demand(stream.create(device, openni::SENSOR_DEPTH), "create");
    openni::Recorder recorder;
    demand(recorder.create(file.c_str()), "record");
    demand(recorder.attach(stream), "attach");
    demand(recorder.start(), "start recorder");
    LastIndex listener;
    stream.addNewFrameListener(&listener);
    demand(stream.start(), "start");
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (listener.last < frames && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    stream.removeNewFrameListener(&listener);
    recorder.stop();
    recorder.destroy();  // joins the writer: the file is complete only now
    stream.stop();
    stream.destroy();
    device.close();
  }
  openni::OpenNI::shutdown();
}

}  // namespace lamina::test
