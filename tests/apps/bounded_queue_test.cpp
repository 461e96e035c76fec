// The queue between reader and mapper.
#include <gtest/gtest.h>

#include <thread>

#include <lamina/apps/bounded_queue.hpp>

namespace lamina::apps {
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

}  // namespace
}  // namespace lamina::apps
