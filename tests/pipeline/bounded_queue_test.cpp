// The queue between reader and mapper, and the order in which the reader hands out.
#include <gtest/gtest.h>

#include <thread>

#include <lamina/models/error.hpp>
#include <lamina/models/skipped.hpp>
#include <lamina/pipeline/bounded_queue.hpp>
#include <lamina/pipeline/reader.hpp>

namespace lamina {
namespace {

TEST(BoundedQueue, HandsOverInOrderThroughALittleRoom) {
  BoundedQueue<int> queue(2);
  std::thread producer([&] {
    for (int i = 0; i < 1000; ++i) queue.push(i);
    queue.close();
  });
  int expected = 0;
  while (const auto value = queue.pop()) EXPECT_EQ(*value, expected++);
  EXPECT_EQ(expected, 1000);
  producer.join();
}

TEST(BoundedQueue, CloseFreesAWaitingProducer) {
  BoundedQueue<int> queue(1);
  queue.push(1);
  bool accepted = true;
  std::thread producer([&] { accepted = queue.push(2); });
  queue.close();
  producer.join();
  EXPECT_FALSE(accepted);
}

// Scans every 0.1 s and, from `odometry_from` on, odometry beside them.
class Drive final : public Recording {
 public:
  explicit Drive(double odometry_from, int breaks_after = -1)
      : odometry_from_(odometry_from), left_(breaks_after) {}
  std::optional<Measurement> next() override {
    if (left_-- == 0) throw Error("the file ends here");
    if (given_ == 100) return std::nullopt;
    const Timestamp stamp = Timestamp::from_seconds(0.1 * (given_ / 2));
    const bool scan = given_++ % 2 == 0;
    if (scan || stamp.seconds() < odometry_from_) {
      LaserScan measured;
      measured.stamp = stamp;
      return measured;
    }
    return Odometry{stamp, SE3()};
  }
  const Calibration& calibration() const override { return calibration_; }
  SkippedCounts skipped() const override { return {}; }

 private:
  double odometry_from_;
  int left_, given_ = 0;
  Calibration calibration_;
};

// Positions of the odometry among all, up to the third, and how many there are in all.
std::vector<int> places_of_odometry(double odometry_from, bool wait) {
  Drive drive(odometry_from);
  Reader reader(drive, 8, wait);
  std::vector<int> places;
  int i = 0;
  for (; const auto measurement = reader.next(); ++i) {
    if (std::holds_alternative<Odometry>(*measurement) && places.size() < 3) places.push_back(i);
  }
  places.push_back(i);
  return places;
}

TEST(Reader, WaitsForTheFirstOdometryAlone) {
  EXPECT_EQ(places_of_odometry(0.45, false), (std::vector<int>{11, 13, 15, 100}));
  EXPECT_EQ(places_of_odometry(0.45, true), (std::vector<int>{0, 13, 15, 100}));
}

TEST(Reader, DoesNotWaitForEver) {
  EXPECT_EQ(places_of_odometry(2.45, true), (std::vector<int>{51, 53, 55, 100}));
  EXPECT_EQ(places_of_odometry(1e9, true), std::vector<int>{100});
}

TEST(Reader, HandsOutWhatCameBeforeAFailure) {
  Drive drive(1e9, 5);
  Reader reader(drive, 8, true);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(reader.next());
  EXPECT_THROW(reader.next(), Error);
}

}  // namespace
}  // namespace lamina
