// What a bag holds, topic by topic, whether anything can be mapped with it or not.
#pragma once

#include <string>

#include <lamina/sensors/readers/bag_messages.hpp>

namespace lamina {

/// Aligned lines for people, ending in a newline: of each topic its type, count, rate, longest gap,
/// frame and use; of scans beams, field of view and limits, of images size and encoding; the tree
/// of transforms and what it lacks; what of the file is damaged. Reads all of `source` once.
std::string describe_bag(bag::Source& source);

/// The same of what `input` names; empty where it is no bag. Throws lamina::Error where it is one
/// that cannot be opened.
std::string describe_bag(const std::string& input);

}  // namespace lamina
