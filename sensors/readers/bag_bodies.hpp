// Which body of a bag carries the sensor: its odometry, its frame, and where sensors sit on it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lamina/models/warning.hpp>
#include <lamina/sensors/odometry.hpp>
#include <lamina/sensors/readers/transform_tree.hpp>

namespace lamina {

/// Without the leading slash of old bags.
std::string frame_name(const std::string& name);

/// "odom", also of a robot's own name space: "robot1/odom".
bool is_odometry_frame(const std::string& frame);

/// Gathers transforms and odometry of all bodies of a bag; choose() settles whose they are. One
/// tf tree may hold several robots, and several frames of one robot under its odometry.
class BagBodies {
 public:
  /// Frames by their names without a leading slash. `fixed`: of /tf_static.
  void add_transform(const std::string& parent, const std::string& child, const SE3& T, bool fixed,
                     Timestamp stamp);
  void add_odometry(const std::string& topic, const std::string& child, const Odometry& sample);

  struct Chosen {
    std::string frame;               ///< of the body; empty: none is known
    std::string topic;               ///< of its odometry; empty: transforms, or none
    std::vector<Odometry> odometry;  ///< as recorded
    std::vector<Warning> warnings;
    std::vector<std::string> other_topics;  ///< odometry that was left out
  };
  /// The body whose frame the sensor's frame hangs on; of several, and where it hangs on none, the
  /// one with the most odometry, messages before transforms. `wanted`: an odometry topic by name.
  Chosen choose(const std::string& sensor_frame, const std::string& wanted);
  /// After choose().
  const TransformTree& tree() const { return tree_; }

 private:
  struct Body {
    std::string topic, child;
    std::vector<Odometry> samples;
  };
  struct Moving {
    std::string parent, child;
    SE3 T;
  };
  void add(const std::string& topic, const std::string& child, const Odometry& sample);
  void warn_of_others(const Body& best, const std::string& sensor_frame, Chosen& result) const;

  TransformTree tree_;
  std::vector<Moving> moving_;  ///< used only where nothing static says otherwise
  std::vector<Body> bodies_;    ///< in the order they were met
};

}  // namespace lamina
