// Work on threads, results in order.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <vector>

#include <lamina/models/ordered_parallel.hpp>

namespace lamina {
namespace {

TEST(OrderedBatch, ResultsComeInTheOrderOfTheItems) {
  for (const int threads : {0, 1, 3}) {
    OrderedBatch<int> batch(threads);
    std::vector<int> taken;
    std::vector<int> by_thread(batch.threads());
    const auto run = [&] {
      batch.run(
          [&](int& item, std::size_t thread) {
            item *= item;
            ++by_thread[thread];
          },
          [&](int item) { taken.push_back(item); });
    };
    for (int i = 0; i < 500; ++i) {
      batch.add(i);
      if (batch.full()) run();
    }
    run();
    ASSERT_EQ(taken.size(), 500U) << threads;
    for (int i = 0; i < 500; ++i) ASSERT_EQ(taken[static_cast<std::size_t>(i)], i * i);
    EXPECT_EQ(std::accumulate(by_thread.begin(), by_thread.end(), 0), 500);
    EXPECT_GT(*std::min_element(by_thread.begin(), by_thread.end()), 100);
    run();  // nothing waits
    EXPECT_EQ(taken.size(), 500U);
  }
}

TEST(OrderedBatch, WhatWorkThrowsComesOut) {
  OrderedBatch<int> batch(2);
  for (int i = 0; i < 4; ++i) batch.add(i);
  EXPECT_THROW(batch.run(
                   [](int item, std::size_t) {
                     if (item == 3) throw std::runtime_error("three");
                   },
                   [](int) {}),
               std::runtime_error);
  batch.run([](int, std::size_t) { FAIL(); }, [](int) { FAIL(); });  // nothing waits
}

}  // namespace
}  // namespace lamina
