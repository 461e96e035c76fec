// An OpenNI2 driver that serves simulated depth, so that recording and playing .oni files is tested
// through the stock library with no camera. Built for tests only.
//
// URI: simulated:WIDTHxHEIGHT@FPS*FRAMES. Debian's library loads Drivers/lib*.so.0 beside itself.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <map>
#include <string>
#include <thread>

// OniDriverAPI.h takes these from a header that Debian does not ship.
#ifndef TRUE
#define TRUE 1
#define FALSE 0
#endif
#define XN_NEW(T, ...) new T(__VA_ARGS__)
#define XN_DELETE(p) delete (p)
#include <Driver/OniDriverAPI.h>
#include <OniProperties.h>

#include "sensors/openni_driver/simulated_depth.hpp"

namespace {
using lamina::test::DepthMode;

template <typename T>
OniStatus give(void* data, int* size, const T& value) {
  if (*size < static_cast<int>(sizeof(T))) return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(data, &value, sizeof(T));
  *size = static_cast<int>(sizeof(T));
  return ONI_STATUS_OK;
}

OniVideoMode video_mode(const DepthMode& mode) {
  OniVideoMode result{};
  result.pixelFormat = ONI_PIXEL_FORMAT_DEPTH_1_MM;
  result.resolutionX = mode.width;
  result.resolutionY = mode.height;
  result.fps = mode.fps;
  return result;
}

class DepthStream : public oni::driver::StreamBase {
 public:
  explicit DepthStream(const DepthMode& mode) : mode_(mode) {}
  ~DepthStream() override { stop(); }

  OniStatus start() override {
    running_ = true;
    thread_ = std::thread([this] { serve(); });
    return ONI_STATUS_OK;
  }
  void stop() override {
    running_ = false;
    if (thread_.joinable()) thread_.join();
  }
  OniBool isPropertySupported(int id) override {
    char buffer[256];
    int size = sizeof buffer;
    return getProperty(id, buffer, &size) == ONI_STATUS_OK ? TRUE : FALSE;
  }
  OniStatus getProperty(int id, void* data, int* size) override {
    switch (id) {
      case ONI_STREAM_PROPERTY_VIDEO_MODE:
        return give(data, size, video_mode(mode_));
      case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
        return give(data, size, static_cast<float>(mode_.horizontal_fov()));
      case ONI_STREAM_PROPERTY_VERTICAL_FOV:
        return give(data, size, static_cast<float>(mode_.vertical_fov()));
      // An exclusive bound: the recorder spoils pixels that equal it.
      case ONI_STREAM_PROPERTY_MAX_VALUE:
        return give(data, size, DepthMode::kLargest + 1);
      case ONI_STREAM_PROPERTY_MIN_VALUE:
        return give(data, size, 0);
      case ONI_STREAM_PROPERTY_STRIDE:
        return give(data, size, mode_.width * 2);
      case ONI_STREAM_PROPERTY_MIRRORING:
        return give(data, size, OniBool(FALSE));
      // The file player gives no frame of a stream that had no cropping property.
      case ONI_STREAM_PROPERTY_CROPPING: {
        OniCropping cropping{};
        cropping.enabled = FALSE;
        cropping.width = mode_.width;
        cropping.height = mode_.height;
        return give(data, size, cropping);
      }
      default:
        return ONI_STATUS_NOT_IMPLEMENTED;
    }
  }
  OniStatus setProperty(int id, const void*, int) override {
    return id == ONI_STREAM_PROPERTY_MIRRORING ? ONI_STATUS_OK : ONI_STATUS_NOT_IMPLEMENTED;
  }
  // The recorder writes what is announced here: without it the field of view is lost.
  void notifyAllProperties() override {
    const auto horizontal = static_cast<float>(mode_.horizontal_fov());
    const auto vertical = static_cast<float>(mode_.vertical_fov());
    const int largest = DepthMode::kLargest + 1;
    const OniBool mirror = FALSE;
    raisePropertyChanged(ONI_STREAM_PROPERTY_HORIZONTAL_FOV, &horizontal, sizeof horizontal);
    raisePropertyChanged(ONI_STREAM_PROPERTY_VERTICAL_FOV, &vertical, sizeof vertical);
    raisePropertyChanged(ONI_STREAM_PROPERTY_MAX_VALUE, &largest, sizeof largest);
    raisePropertyChanged(ONI_STREAM_PROPERTY_MIRRORING, &mirror, sizeof mirror);
  }

 private:
  void serve() {
    auto due = std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
    for (int i = 0; running_ && i < mode_.frames; ++i) {
      std::this_thread::sleep_until(due);
      due += std::chrono::microseconds(1000000 / mode_.fps);
      OniFrame* frame = getServices().acquireFrame();
      if (!frame) continue;
      auto* pixels = static_cast<OniDepthPixel*>(frame->data);
      for (int v = 0; v < mode_.height; ++v) {
        for (int u = 0; u < mode_.width; ++u) {
          pixels[v * mode_.width + u] = simulated_depth_mm(mode_, u, v, i);
        }
      }
      frame->frameIndex = i + 1;
      frame->videoMode = video_mode(mode_);
      frame->width = mode_.width;
      frame->height = mode_.height;
      frame->cropOriginX = frame->cropOriginY = 0;
      frame->croppingEnabled = FALSE;
      frame->sensorType = ONI_SENSOR_DEPTH;
      frame->stride = mode_.width * 2;
      frame->dataSize = mode_.width * mode_.height * 2;
      frame->timestamp = mode_.stamp_us(i);
      raiseNewFrame(frame);
      getServices().releaseFrame(frame);
    }
  }
  DepthMode mode_;
  std::atomic<bool> running_{false};
  std::thread thread_;
};

class DepthDevice : public oni::driver::DeviceBase {
 public:
  explicit DepthDevice(const DepthMode& mode) : mode_(mode), video_(video_mode(mode)) {
    info_.sensorType = ONI_SENSOR_DEPTH;
    info_.numSupportedVideoModes = 1;
    info_.pSupportedVideoModes = &video_;
  }
  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override {
    *sensors = &info_;
    *count = 1;
    return ONI_STATUS_OK;
  }
  oni::driver::StreamBase* createStream(OniSensorType type) override {
    return type == ONI_SENSOR_DEPTH ? new DepthStream(mode_) : nullptr;
  }
  void destroyStream(oni::driver::StreamBase* stream) override { delete stream; }
  OniStatus getProperty(int id, void* data, int* size) override {
    if (id != ONI_DEVICE_PROPERTY_DRIVER_VERSION) return ONI_STATUS_NOT_IMPLEMENTED;
    return give(data, size, OniVersion{1, 0, 0, 0});
  }

 private:
  DepthMode mode_;
  OniVideoMode video_;
  OniSensorInfo info_{};
};

bool parse_uri(const char* uri, DepthMode& mode) {
  return std::sscanf(uri, "simulated:%dx%d@%d*%d", &mode.width, &mode.height, &mode.fps,
                     &mode.frames) == 4;
}

class SimulatedDriver : public oni::driver::DriverBase {
 public:
  explicit SimulatedDriver(OniDriverServices* services) : DriverBase(services) {}
  OniStatus tryDevice(const char* uri) override {
    DepthMode mode;
    if (!parse_uri(uri, mode)) return ONI_STATUS_ERROR;
    OniDeviceInfo& info = infos_[uri];
    std::snprintf(info.uri, ONI_MAX_STR, "%s", uri);
    std::snprintf(info.vendor, ONI_MAX_STR, "lamina");
    std::snprintf(info.name, ONI_MAX_STR, "simulated depth");
    deviceConnected(&info);
    return ONI_STATUS_OK;
  }
  oni::driver::DeviceBase* deviceOpen(const char* uri, const char*) override {
    DepthMode mode;
    return parse_uri(uri, mode) ? new DepthDevice(mode) : nullptr;
  }
  void deviceClose(oni::driver::DeviceBase* device) override { delete device; }
  void shutdown() override {}

 private:
  std::map<std::string, OniDeviceInfo> infos_;
};
}  // namespace

ONI_EXPORT_DRIVER(SimulatedDriver)
