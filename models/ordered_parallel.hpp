// Many small pieces of work on all threads, their results in order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <future>
#include <utility>
#include <vector>

namespace lamina {

/// Items that wait until there are enough of them to be worth a thread. All threads work on them,
/// then they are taken in the order they came in: the same for any number of threads.
template <class Item>
class OrderedBatch {
 public:
  /// `each`: items for each thread at once.
  explicit OrderedBatch(int threads, std::size_t each = 32)
      : threads_(static_cast<std::size_t>(std::max(1, threads))), each_(each) {}

  std::size_t threads() const { return threads_; }
  bool full() const { return items_.size() >= each_ * threads_; }
  void add(Item item) { items_.push_back(std::move(item)); }

  /// work(item, thread) for each, on threads numbered from 0, then take(item) for each in order.
  /// Throws what these throw. Nothing waits any more then.
  template <class Work, class Take>
  void run(const Work& work, const Take& take) {
    std::vector<Item> items = std::exchange(items_, {});
    const auto share = [&](std::size_t thread) {
      for (std::size_t i = thread; i < items.size(); i += threads_) work(items[i], thread);
    };
    std::vector<std::future<void>> others;
    for (std::size_t k = 1; k < threads_; ++k)
      others.push_back(std::async(std::launch::async, share, k));
    share(0);
    for (auto& other : others) other.get();
    for (Item& item : items) take(item);
  }

 private:
  std::size_t threads_, each_;
  std::vector<Item> items_;
};

}  // namespace lamina
