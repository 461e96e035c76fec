// A running robot's messages: one time line, bounded queues, a first look, the end.
#include <gtest/gtest.h>

#include <map>

#include <lamina/models/error.hpp>
#include <lamina/sensors/readers/bag_recording.hpp>
#include <lamina/sensors/ros2/cdr_writer.hpp>
#include <lamina/sensors/ros2/live_source.hpp>

namespace lamina::ros2 {
namespace {

using bag::Kind;
using bag::Message;

constexpr std::int64_t kSecond = 1000000000, kBegin = 1700000000 * kSecond;

Message header(Kind kind, const std::string& frame, std::int64_t stamp_ns) {
  Message m;
  m.kind = kind;
  m.frame = frame;
  m.stamp_ns = stamp_ns;
  m.pose = {0, 0, 0, 0, 0, 0, 1};
  return m;
}

std::string scan(std::int64_t stamp_ns) {
  Message m = header(Kind::kScan, "laser", stamp_ns);
  m.angle_min = -1;
  m.angle_increment = 0.5f;
  m.range_max = 10;
  m.ranges = {1, 2, 3, 2, 1 + 1e-9f * static_cast<float>(stamp_ns - kBegin)};
  return encode(m).bytes;
}

std::string odometry(std::int64_t stamp_ns, double x) {
  Message m = header(Kind::kOdometry, "odom", stamp_ns);
  m.child_frame = "base_link";
  m.pose[0] = x;
  return encode(m).bytes;
}

std::string mounting() {
  Message m = header(Kind::kTransform, "base_link", kBegin);
  m.child_frame = "laser";
  m.pose[0] = 0.2;
  return encode(m).bytes;
}

// What a wire gives is what the test puts into it.
class FakeWire final : public dds::Wire {
 public:
  std::vector<dds::OfferedTopic> offered;
  std::map<std::string, dds::Received> subscribed;
  std::function<void()> asked = [] {};  // each time topics are asked for
  int alive = 1;

  std::vector<dds::OfferedTopic> topics() override {
    asked();
    return offered;
  }
  bool subscribe(const dds::OfferedTopic& topic, dds::Received received) override {
    subscribed[topic.name] = std::move(received);
    return true;
  }
  void unsubscribe(const std::string& topic) override { subscribed.erase(topic); }
  int publishers(const std::string&) override { return alive; }
  std::int64_t lost(const std::string&) override { return 0; }
  bool advertise(const std::string&, const std::string&, const dds::Qos&) override { return true; }
  bool write(const std::string&, std::string_view) override { return true; }
  void flush(double) override {}
  void send(const std::string& topic, const std::string& bytes) {
    if (const auto found = subscribed.find(topic); found != subscribed.end()) found->second(bytes);
  }
};

LiveOptions quick() {
  LiveOptions options;
  options.first = 0.1;
  options.look = 0.01;
  options.complete = 0.05;
  options.gone = 0.02;
  options.ask = 0.005;
  options.queue.hold = 0.02;
  return options;
}

// A robot whose first second is in the first look.
std::unique_ptr<FakeWire> robot() {
  auto wire = std::make_unique<FakeWire>();
  wire->offered = {{"/odom", "nav_msgs/msg/Odometry", {}, 1},
                   {"/scan", "sensor_msgs/msg/LaserScan", {}, 1},
                   {"/tf_static", "tf2_msgs/msg/TFMessage", {}, 1}};
  wire->asked = [w = wire.get(), done = false]() mutable {
    if (done || w->subscribed.empty()) return;
    done = true;
    w->send("/tf_static", mounting());
    for (int i = 0; i <= 10; ++i) {
      w->send("/odom", odometry(kBegin + i * kSecond / 10, 0.01 * i));
      w->send("/scan", scan(kBegin + i * kSecond / 10));
    }
  };
  return wire;
}

std::vector<double> scan_times(Recording& recording) {
  std::vector<double> all;
  while (const auto measurement = recording.next())
    if (const auto* found = std::get_if<LaserScan>(&*measurement))
      all.push_back(found->stamp - Timestamp::from_nanoseconds(kBegin));
  return all;
}

TEST(LiveClock, GoesOnWhereItStoodForEachStream) {
  LiveClock clock;
  const auto at = [&](const char* stream, double stamp, double arrival) {
    return 1e-9 * static_cast<double>(clock.adjusted(stream, static_cast<std::int64_t>(1e9 * stamp),
                                                     static_cast<std::int64_t>(1e9 * arrival)));
  };
  EXPECT_DOUBLE_EQ(at("scan", 100, 0), 100);
  EXPECT_DOUBLE_EQ(at("odom", 100.1, 0.1), 100.1);
  EXPECT_DOUBLE_EQ(at("odom", 100.05, 0.1), 100.05);  // came late
  EXPECT_NEAR(at("scan", 50, 0.2), 100.15, 1e-6);     // set back
  EXPECT_NEAR(at("odom", 50.1, 0.3), 100.25, 1e-6);   // the same step
  EXPECT_EQ(clock.steps(), 1u);
  EXPECT_NEAR(at("scan", 5000, 0.4), 100.30, 1e-6);  // set ahead
  EXPECT_EQ(clock.steps(), 2u);
}

TEST(LiveQueue, DropsTheOldestOfAFullTopicAndCounts) {
  LiveQueueOptions options;
  options.most = 3;
  LiveQueue queue(options);
  const std::size_t topic = queue.add_topic(LiveOrder::kStamped);
  queue.end_look();
  queue.go_live({true}, {});
  for (int i = 0; i < 5; ++i) queue.put(topic, scan(kBegin + i));
  EXPECT_EQ(queue.dropped(), std::vector<std::int64_t>{2});
  EXPECT_EQ(queue.take(1)->stamp, kBegin + 2);
}

TEST(LiveQueue, FramesWaitForOdometryAndOlderFrames) {
  LiveQueue queue;
  const std::size_t scans = queue.add_topic(LiveOrder::kStamped);
  const std::size_t odom = queue.add_topic(LiveOrder::kOdometry);
  queue.end_look();
  queue.go_live({true, true}, {});
  queue.put(odom, odometry(kBegin, 0));
  queue.put(scans, scan(kBegin + 10));
  EXPECT_EQ(queue.take(0)->topic, odom);
  EXPECT_FALSE(queue.take(0));  // the odometry does not reach the scan yet
  queue.put(odom, odometry(kBegin + 20, 0));
  EXPECT_EQ(queue.take(0)->topic, odom);
  EXPECT_EQ(queue.take(0)->topic, scans);
}

TEST(LiveQueue, WaitsForFramesThatAreDueAndNoOthers) {
  LiveQueue queue;
  const std::size_t slow = queue.add_topic(LiveOrder::kStamped);
  const std::size_t fast = queue.add_topic(LiveOrder::kStamped);
  queue.end_look();
  queue.go_live({true, true}, {});
  const std::int64_t period = kSecond / 2;
  std::int64_t last = kBegin;
  for (int i = 0; i < 50; ++i) {
    last = kBegin + i * period;
    queue.put(slow, scan(last));
    queue.put(fast, scan(last));
  }
  while (queue.take(0)) {
  }
  queue.put(fast, scan(last + period * 4 / 5));
  EXPECT_TRUE(queue.take(0)) << "before the next of the slow topic";
  queue.put(fast, scan(last + period));
  EXPECT_FALSE(queue.take(0)) << "the slow topic's next has this stamp and is to come";
  queue.put(slow, scan(last + period));
  EXPECT_TRUE(queue.take(0));
  EXPECT_TRUE(queue.take(0));
}

TEST(HeaderStamp, OfBothByteOrders) {
  Message m = header(Kind::kScan, "laser", kBegin + 5);
  m.ranges = {1, 2};
  EXPECT_EQ(header_stamp(encode(m).bytes), kBegin + 5);
  EXPECT_EQ(header_stamp(encode(m, true).bytes), kBegin + 5);
  m.stamp_ns = 0;
  EXPECT_FALSE(header_stamp(encode(m).bytes));
  EXPECT_FALSE(header_stamp("short"));
}

TEST(LiveSource, FramesOfTheLookThenThoseThatComeThenTheEnd) {
  auto wire = robot();
  FakeWire* robot = wire.get();
  auto source = make_live_source(std::move(wire), quick());
  bag::LiveSource* live = source.get();
  BagRecording recording("ros2:", std::move(source), {}, live);
  EXPECT_EQ(recording.body_frame(), "base_link");
  EXPECT_EQ(recording.odometry_frame(), "odom");
  ASSERT_TRUE(recording.calibration().lidar);
  EXPECT_NEAR(recording.calibration().lidar->T_body_lidar.translation().x(), 0.2, 1e-12);
  for (int i = 11; i <= 20; ++i) {
    robot->send("/odom", odometry(kBegin + i * kSecond / 10, 0.01 * i));
    robot->send("/scan", scan(kBegin + i * kSecond / 10));
  }
  robot->send("/scan", scan(kBegin + 21 * kSecond / 10).substr(0, 40));  // cut short
  robot->alive = 0;
  const auto times = scan_times(recording);
  ASSERT_EQ(times.size(), 21u);
  EXPECT_NEAR(times.back(), 2, 1e-9);
  EXPECT_EQ(recording.skipped().at("damaged message"), 1);
}

TEST(LiveSource, ClockThatIsSetBackIsSaidAndTimesGoOn) {
  auto wire = robot();
  FakeWire* robot = wire.get();
  auto source = make_live_source(std::move(wire), quick());
  bag::LiveSource* live = source.get();
  BagRecording recording("ros2:", std::move(source), {}, live);
  for (int i = 0; i < 5; ++i) {
    robot->send("/odom", odometry(kBegin - 1000 * kSecond + i * kSecond / 10, 0.2));
    robot->send("/scan", scan(kBegin - 1000 * kSecond + i * kSecond / 10));
  }
  robot->alive = 0;
  const auto times = scan_times(recording);
  ASSERT_EQ(times.size(), 16u);
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  const auto warnings = recording.warnings();
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(),
                          [](const Warning& w) { return w.id == "clock_set"; }));
}

TEST(LiveSource, NothingToMapListsWhatIsThere) {
  auto wire = std::make_unique<FakeWire>();
  wire->offered = {{"/chatter", "std_msgs/msg/String", {}, 1}};
  auto source = make_live_source(std::move(wire), quick());
  bag::LiveSource* live = source.get();
  try {
    BagRecording recording("ros2:", std::move(source), {}, live);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("/chatter (std_msgs/String"), std::string::npos);
  }
}

}  // namespace
}  // namespace lamina::ros2
