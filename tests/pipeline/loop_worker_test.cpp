// Loops closed beside the front-end are those closed in line.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <lamina/pipeline/loop_worker.hpp>

#include "frontend/motion/planar_world.hpp"

namespace lamina {
namespace {

// Once and a half round in a room, one way of 0.2 m a step.
std::vector<Step> laps() {
  constexpr double kRadius = 1, kTurn = 0.2;
  testing::Scanner scanner;
  scanner.beams = 121;
  std::vector<Step> steps;
  for (int i = 0; i * kTurn < 3 * M_PI; ++i) {
    Step step;
    step.observations.stamp = Timestamp::from_seconds(i);
    const SE3 on_circle =
        SE3::planar(kRadius * std::sin(kTurn * i), kRadius * (1 - std::cos(kTurn * i)), kTurn * i);
    step.scan = scanner.scan(testing::room(), SE3::planar(-1, 0, 0) * on_circle, i);
    step.scan_motion.emplace();
    if (i > 0)
      step.scan_motion->T_prev_curr_body =
          SE3::planar(kRadius * std::sin(kTurn), kRadius * (1 - std::cos(kTurn)), kTurn);
    step.scan_motion->covariance = 1e-4 * Matrix6d::Identity();
    steps.push_back(std::move(step));
  }
  return steps;
}

struct Closed {
  std::vector<Timestamp> stamps;
  std::vector<LoopClosure> loops;
};

Closed close(bool beside) {
  LoopCloserOptions options;
  options.submap_length = 0.8;
  options.thin_cell = 0.15;
  LoopCloser closer(options);
  Closed result;
  const auto take = [&](std::vector<ClosedStep>&& steps) {
    for (const ClosedStep& one : steps) {
      EXPECT_TRUE(one.closing_ms);
      result.stamps.push_back(one.step.observations.stamp);
      result.loops.insert(result.loops.end(), one.loops.begin(), one.loops.end());
    }
  };
  LoopWorker worker(&closer, beside);
  for (Step& step : laps()) {
    worker.add(std::move(step));
    take(worker.ready());
  }
  take(worker.drain());
  EXPECT_TRUE(worker.drain().empty());
  return result;
}

TEST(LoopWorker, BesideTheFrontEndItFindsTheSame) {
  const Closed in_line = close(false), beside = close(true);
  ASSERT_EQ(in_line.stamps.size(), laps().size());
  EXPECT_TRUE(std::is_sorted(in_line.stamps.begin(), in_line.stamps.end()));
  EXPECT_EQ(beside.stamps, in_line.stamps);
  ASSERT_FALSE(in_line.loops.empty());
  ASSERT_EQ(beside.loops.size(), in_line.loops.size());
  for (std::size_t i = 0; i < in_line.loops.size(); ++i) {
    EXPECT_EQ(beside.loops[i].from, in_line.loops[i].from);
    EXPECT_EQ(beside.loops[i].to, in_line.loops[i].to);
    EXPECT_EQ(beside.loops[i].T_from_to.translation(), in_line.loops[i].T_from_to.translation());
  }
}

TEST(LoopWorker, WithoutACloserStepsComeBackAsTheyAre) {
  LoopWorker worker(nullptr, true);
  for (Step& step : laps()) worker.add(std::move(step));
  const auto back = worker.drain();
  ASSERT_EQ(back.size(), laps().size());
  for (const ClosedStep& one : back) EXPECT_FALSE(one.closing_ms);
}

// A motion without its scan is what no front-end makes. Steps before it may wait to be taken.
TEST(LoopWorker, WhatTheCloserThrewIsNotLostBehindWhatWasDone) {
  LoopCloser closer;
  LoopWorker worker(&closer, true);
  std::vector<Step> steps = laps();
  for (int i = 0; i < 3; ++i) worker.add(std::move(steps[static_cast<std::size_t>(i)]));
  steps[3].scan.reset();
  worker.add(std::move(steps[3]));
  EXPECT_THROW(worker.drain(), std::bad_optional_access);
}

TEST(LoopWorker, StoppedItLeavesTheRest) {
  LoopCloser closer;
  LoopWorker worker(&closer, true);
  for (Step& step : laps()) worker.add(std::move(step));
  worker.stop();
  EXPECT_LE(worker.drain().size(), laps().size());
}

}  // namespace
}  // namespace lamina
