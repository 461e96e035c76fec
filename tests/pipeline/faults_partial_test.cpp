// One sensor of several ends, begins late or pauses: the others go on.
#include "pipeline/faulty_room.hpp"

namespace lamina {
namespace {

using Keep = std::function<bool(double)>;  // by the time since the start, s

// What is left of odometry and scans; nothing of a stream whose function is empty.
Outcome outcome_of(const Keep& odometry, const Keep& scans) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_room(data, Senses::kAll);
  const auto thin = [&data](const char* file, const Keep& keep) {
    if (!keep) {
      fs::remove(data / file);
      return;
    }
    edit_lines(data / file, [&](double time, std::string&) { return keep(time - kStart); });
  };
  thin("odometry.txt", odometry);
  thin("scans.csv", scans);
  return map_and_evaluate(folder, data);
}

bool always(double) { return true; }
bool first_half(double t) { return t < 8; }

void expect_good(const Outcome& outcome) {
  EXPECT_LT(outcome.ate, 0.03);
  EXPECT_FALSE(outcome.says_lost);
}

TEST(OneOfSeveral, WheelsEnd) { expect_good(outcome_of(first_half, {})); }

TEST(OneOfSeveral, WheelsAndScansEnd) { expect_good(outcome_of(first_half, first_half)); }

TEST(OneOfSeveral, ScansEndWhereThereAreNoWheels) { expect_good(outcome_of({}, first_half)); }

TEST(OneOfSeveral, WheelsBeginLate) {
  expect_good(outcome_of([](double t) { return t > 4; }, {}));
}

TEST(OneOfSeveral, ScansBeginLate) {
  expect_good(outcome_of(always, [](double t) { return t > 8; }));
}

TEST(OneOfSeveral, ScansPauseWhereThereAreNoWheels) {
  expect_good(outcome_of({}, [](double t) { return t < 8 || t > 11; }));
}

TEST(OneOfSeveral, WheelsPause) {
  expect_good(outcome_of([](double t) { return t < 8 || t > 11; }, {}));
}

// Nothing left but images of nothing.
TEST(OneOfSeveral, WhenAllEndItIsSaid) {
  const Folder folder;
  const fs::path data = folder.path() / "data";
  simulate_room(data, Senses::kAll);
  const auto early = [](double time, std::string&) { return time < kStart + 8; };
  edit_lines(data / "odometry.txt", early);
  edit_lines(data / "scans.csv", early);
  edit_images(data, [](double time, DepthImage& image) {
    if (time > kStart + 9) std::fill(image.pixels.begin(), image.pixels.end(), std::uint16_t{0});
  });
  const Outcome outcome = map_and_evaluate(folder, data);
  EXPECT_TRUE(outcome.says_lost);
  EXPECT_LT(outcome.lost_after, kStart + 11);
}

}  // namespace
}  // namespace lamina
