// Messages of ROS 2 in both byte orders, whole, cut at any byte, and with lengths that lie.
#include <gtest/gtest.h>

#include <lamina/sensors/ros2/cdr_messages.hpp>
#include <lamina/sensors/ros2/cdr_writer.hpp>

#include "sensors/ros2/cdr_bytes.hpp"

namespace lamina::ros2 {
namespace {

using bag::Kind;
using bag::Message;
using Status = bag::Source::Status;
using test::CdrBytes;

struct Decoded {
  Status status = Status::kEnd;
  Message message;
  std::deque<Message> transforms;
};

Decoded decoded(const std::string& type, std::string_view bytes) {
  Decoded result;
  bag::DepthReader depth;
  result.message.topic = "/topic";
  result.message.stamp_ns = 77;
  result.status = decode(type_of_ros1(type), bytes, depth, result.message, result.transforms);
  return result;
}

std::vector<Message> samples() {
  std::vector<Message> all(6);
  for (Message& m : all) {
    m.frame = "a frame";
    m.stamp_ns = 1700000000123456789;
    m.pose = {1, 2, 3, 0.1, 0.2, 0.3, 0.9};
    m.child_frame = "child";
  }
  all[0].kind = Kind::kScan;
  all[0].angle_min = -1.5f;
  all[0].angle_increment = 0.25f;
  all[0].range_min = 0.1f;
  all[0].range_max = 30;
  all[0].time_increment = 1e-4f;
  all[0].ranges = {1, 2, 3, 4.5f};
  all[1].kind = Kind::kDepth;
  all[1].width = 3;
  all[1].height = 2;
  all[1].depth = {1, 2, 3, 4, 500, 60000};
  all[2].kind = Kind::kCameraInfo;
  all[2].width = 640;
  all[2].height = 480;
  all[2].intrinsics = {525, 526, 319.5, 239.5};
  all[2].distortion = {0.1, 0.2, 0.3, 0.4, 0.5};
  all[2].distortion_model = "plumb_bob";
  all[3].kind = Kind::kOdometry;
  all[4].kind = Kind::kTransform;
  all[5].kind = Kind::kImu;
  all[5].acceleration = {0.1, 0.2, 9.8};
  return all;
}

void expect_same(const Message& a, const Message& b) {
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.frame, b.frame);
  EXPECT_EQ(a.stamp_ns, b.stamp_ns);
  EXPECT_EQ(a.angle_min, b.angle_min);
  EXPECT_EQ(a.angle_increment, b.angle_increment);
  EXPECT_EQ(a.range_min, b.range_min);
  EXPECT_EQ(a.range_max, b.range_max);
  EXPECT_EQ(a.time_increment, b.time_increment);
  EXPECT_EQ(a.ranges, b.ranges);
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.intrinsics, b.intrinsics);
  EXPECT_EQ(a.distortion, b.distortion);
  EXPECT_EQ(a.distortion_model, b.distortion_model);
  EXPECT_EQ(a.acceleration, b.acceleration);
}

TEST(CdrMessages, WhatIsWrittenIsReadInBothByteOrders) {
  for (const bool big : {false, true}) {
    for (const Message& m : samples()) {
      const CdrMessage coded = encode(m, big);
      const Decoded read = decoded(coded.type, coded.bytes);
      ASSERT_EQ(read.status, Status::kMessage) << coded.type;
      const Message& found = m.kind == Kind::kTransform ? read.transforms.at(0) : read.message;
      expect_same(found, m);
      if (m.kind != Kind::kOdometry && m.kind != Kind::kTransform) continue;
      EXPECT_EQ(found.pose, m.pose);
      EXPECT_EQ(found.child_frame, m.child_frame);
    }
  }
}

// The fields that are read may be whole in a cut message; what is cut within them is damaged.
TEST(CdrMessages, CutAtAnyByteIsDamagedOrWhole) {
  for (const Message& m : samples()) {
    const CdrMessage coded = encode(m);
    for (std::size_t size = 0; size < coded.bytes.size(); ++size) {
      const Decoded read = decoded(coded.type, std::string(coded.bytes, 0, size));
      if (read.status == Status::kDamaged) continue;
      const bool transform = m.kind == Kind::kTransform;
      ASSERT_EQ(read.status, Status::kMessage) << coded.type << " at " << size;
      expect_same(transform ? read.transforms.at(0) : read.message, m);
    }
  }
}

TEST(CdrMessages, LengthsThatLieAreDamaged) {
  for (const Message& m : samples()) {
    const CdrMessage coded = encode(m);
    for (std::size_t at = 4; at + 4 <= coded.bytes.size(); at += 4) {
      std::string bytes = coded.bytes;
      for (std::size_t k = 0; k < 4; ++k) bytes[at + k] = '\xff';
      decoded(coded.type, bytes);  // any answer, at once and within the message's own size
    }
  }
  const auto long_scan = CdrBytes().header(1, 0, "laser");
  EXPECT_EQ(decoded("sensor_msgs/msg/LaserScan", long_scan.bytes()).status, Status::kDamaged);
}

TEST(CdrMessages, OtherRepresentationsAreDamaged) {
  std::string bytes = encode(samples()[0]).bytes;
  for (const char kind : {2, 3, 6, 7, 100}) {
    bytes[1] = kind;
    EXPECT_EQ(decoded("sensor_msgs/msg/LaserScan", bytes).status, Status::kDamaged);
  }
  EXPECT_EQ(decoded("sensor_msgs/msg/LaserScan", "").status, Status::kDamaged);
}

TEST(CdrMessages, AStampOfZeroIsTheTimeOfRecording) {
  Message scan = samples()[0];
  scan.stamp_ns = 0;
  EXPECT_EQ(decoded("sensor_msgs/msg/LaserScan", encode(scan).bytes).message.stamp_ns, 77);
  EXPECT_EQ(decoded("std_msgs/msg/String", "anything").message.stamp_ns, 77);
}

TEST(CdrMessages, TheFirstEchoCounts) {
  CdrBytes bytes(true);
  bytes.header(5, 6, "laser");
  for (const float value : {-1.0f, 1.0f, 1.0f, 0.0f, 0.0f, 0.1f, 10.0f}) bytes.put(value);
  bytes.put(std::uint32_t{3});
  bytes.put(std::uint32_t{2}).put(1.5f).put(2.5f);
  bytes.put(std::uint32_t{0});
  bytes.put(std::uint32_t{1}).put(4.5f);
  const Decoded read = decoded("sensor_msgs/msg/MultiEchoLaserScan", bytes.bytes());
  ASSERT_EQ(read.status, Status::kMessage);
  EXPECT_EQ(read.message.ranges, (std::vector<float>{1.5f, 0, 4.5f}));
  EXPECT_EQ(read.message.stamp_ns, 5000000006);
}

CdrBytes cloud(std::uint32_t width, std::uint32_t height, std::uint32_t row,
               const std::string& data, std::uint8_t type = 7) {
  CdrBytes bytes;
  bytes.header(1, 0, "lidar").put(height).put(width).put(std::uint32_t{3});
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z"}) {
    bytes.text(name).put(offset).put(type).put(std::uint32_t{1});
    offset += 4;
  }
  bytes.put(std::uint8_t{0}).put(std::uint32_t{16}).put(row).blob(data).put(std::uint8_t{1});
  return bytes;
}

TEST(CdrMessages, CloudsByTheirFields) {
  std::string data(2 * 40, '\0');  // two rows of two points of 16 bytes, and 8 bytes of padding
  for (std::size_t i = 0; i < 4; ++i) {
    const float xyz[3] = {static_cast<float>(i), 1, -2};
    std::memcpy(data.data() + (i / 2) * 40 + (i % 2) * 16, xyz, sizeof xyz);
  }
  const Decoded read = decoded("sensor_msgs/msg/PointCloud2", cloud(2, 2, 40, data).bytes());
  ASSERT_EQ(read.status, Status::kMessage);
  ASSERT_EQ(read.message.points.size(), 4u);
  EXPECT_EQ(read.message.points[3], (std::array<float, 3>{3, 1, -2}));
  const auto status = [&](const CdrBytes& bytes) {
    return decoded("sensor_msgs/msg/PointCloud2", bytes.bytes()).status;
  };
  EXPECT_EQ(status(cloud(2, 3, 40, data)), Status::kWrongFormat);  // fewer bytes than claimed
  EXPECT_EQ(status(cloud(0xffffffff, 0xffffffff, 40, data)), Status::kWrongFormat);
  EXPECT_EQ(status(cloud(2, 0xffffffff, 0, data)), Status::kWrongFormat);
  EXPECT_EQ(status(cloud(2, 2, 40, data, 4)), Status::kWrongFormat);  // whole numbers
}

TEST(CdrMessages, TypesHaveTheNamesOfRos1) {
  EXPECT_EQ(type_of_ros1("sensor_msgs/msg/LaserScan"), "sensor_msgs/LaserScan");
  EXPECT_EQ(type_of_ros1("odd"), "odd");
}

}  // namespace
}  // namespace lamina::ros2
