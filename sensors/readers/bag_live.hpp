// Messages of a running robot: a first look at them as at a file, then what comes.
#pragma once

#include <string>
#include <vector>

#include <lamina/models/skipped.hpp>
#include <lamina/models/warning.hpp>
#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina::bag {

/// Until go_live(), topics(), select() and next() are of what was received during the first look,
/// as of a file that ends there.
class LiveSource : public Source {
 public:
  /// From here on next() waits: it gives frames of these topics from the first look's on, in order
  /// of their stamps; odometry and transforms as they come, from after the look on. kEnd: asked to
  /// end, or the publishers are gone.
  virtual void go_live(const std::vector<std::string>& topics) = 0;
  /// What was dropped and lost, by topic.
  virtual SkippedCounts skipped() const = 0;
  virtual std::vector<Warning> warnings() const = 0;
};

}  // namespace lamina::bag
