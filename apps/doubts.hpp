// What a run says of its own result.
#pragma once

#include <string>
#include <vector>

#include <lamina/apps/front_end.hpp>
#include <lamina/io/metrics.hpp>

namespace lamina::apps {

/// What makes a result doubtful as a whole, the likely cause first. `input`: the recording's name.
std::vector<Warning> doubts(const std::string& input, const FrontEnd& front_end,
                            io::Metrics& metrics);

}  // namespace lamina::apps
