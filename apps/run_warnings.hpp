// What a run says of its input and its result, from all who found something.
#pragma once

#include <functional>
#include <string>

#include <lamina/apps/front_end.hpp>
#include <lamina/io/metrics.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina::apps {

/// What no file or topic stated, said once.
void note_assumed(const Recording& recording, io::Metrics& metrics);
/// Where a signal ended the run.
void warn_of_end(const Recording& recording, io::Metrics& metrics);
/// What makes the result doubtful, by the reader first: causes before consequences.
void warn_of_result(const std::string& input, const Recording& recording, const FrontEnd& front_end,
                    io::Metrics& metrics);
/// Online nothing is known of a scanner before the robot has driven: what a first look would have
/// corrected is said at the end. `again`: the recording, opened anew.
void warn_of_scanner(Recording& again, const Settings& settings, const std::function<bool()>& ended,
                     io::Metrics& metrics);

}  // namespace lamina::apps
