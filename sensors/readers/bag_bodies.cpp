// Bodies by topic and frame.
#include <lamina/sensors/readers/bag_bodies.hpp>

#include <algorithm>
#include <tuple>

namespace lamina {
namespace {

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// Frames that move against the body: no mounting may be read through them.
bool is_world(const std::string& frame) {
  return frame == "map" || frame == "world" || is_odometry_frame(frame) ||
         ends_with(frame, "/map") || ends_with(frame, "/world");
}

}  // namespace

bool is_odometry_frame(const std::string& frame) {
  return frame == "odom" || ends_with(frame, "/odom");
}

std::string frame_name(const std::string& name) {
  return !name.empty() && name.front() == '/' ? name.substr(1) : name;
}

void BagBodies::add(const std::string& topic, const std::string& child, const Odometry& sample) {
  const auto same = [&](const Body& body) { return body.topic == topic && body.child == child; };
  auto body = std::find_if(bodies_.begin(), bodies_.end(), same);
  if (body == bodies_.end()) body = bodies_.insert(bodies_.end(), {topic, child, {}});
  body->samples.push_back(sample);
}

void BagBodies::add_transform(const std::string& parent, const std::string& child, const SE3& T,
                              bool fixed, Timestamp stamp) {
  if (is_odometry_frame(parent)) {
    add("", child, {stamp, T});
  } else if (!is_world(parent) && !is_world(child)) {
    if (fixed) tree_.add(parent, child, T);
    if (!fixed) moving_.push_back({parent, child, T});
  }
}

void BagBodies::add_odometry(const std::string& topic, const std::string& child,
                             const Odometry& sample) {
  add(topic, child, sample);
}

// Others that are no frames of the same robot.
void BagBodies::warn_of_others(const Body& best, const std::string& sensor_frame,
                               Chosen& result) const {
  std::string others;
  for (const Body& body : bodies_) {
    if (body.child == best.child || body.child.empty() || tree_.lookup(best.child, body.child) ||
        others.find("'" + body.child + "'") != std::string::npos)
      continue;
    others += (others.empty() ? "'" : ", '") + body.child + "'";
  }
  if (others.empty() || best.child.empty()) return;
  const bool hangs = tree_.lookup(best.child, sensor_frame).has_value();
  result.warnings.push_back(
      {"two_robots", "the recording holds odometry of several bodies: that of '" + best.child +
                         "' is used, which " +
                         (hangs ? "carries the sensor ('" + sensor_frame + "')"
                                : "has the most of it (no transform leads from any of them to the "
                                  "sensor's frame '" +
                                      sensor_frame + "')") +
                         "; left out: " + others});
}

BagBodies::Chosen BagBodies::choose(const std::string& sensor_frame, const std::string& wanted) {
  for (const Moving& m : moving_) tree_.add(m.parent, m.child, m.T);
  moving_.clear();
  const auto rank = [&](const Body& body) {
    const bool hangs = tree_.lookup(body.child, sensor_frame).has_value();
    const bool of_topic = !body.topic.empty();
    return std::tuple(!wanted.empty() && body.topic == wanted, hangs, of_topic,
                      body.samples.size());
  };
  Chosen result;
  const auto best =
      std::max_element(bodies_.begin(), bodies_.end(),
                       [&](const Body& a, const Body& b) { return rank(a) < rank(b); });
  if (best == bodies_.end()) return result;
  result.frame = best->child;
  result.topic = best->topic;
  result.odometry = best->samples;
  for (const Body& body : bodies_) {
    if (!body.topic.empty() && body.topic != best->topic) result.other_topics.push_back(body.topic);
  }
  warn_of_others(*best, sensor_frame, result);
  return result;
}

}  // namespace lamina
