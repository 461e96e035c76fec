// What a run says of its own result.
#pragma once

#include <string>
#include <vector>

#include <lamina/frontend/frontend.hpp>
#include <lamina/models/diagnostics.hpp>

namespace lamina {

/// What makes a result doubtful as a whole, the likely cause first. `input`: the recording's name.
std::vector<Warning> result_warnings(const std::string& input, const FrontEnd& front_end,
                                     Diagnostics& metrics);

}  // namespace lamina
