// What a run says of its input and its result, from all who found something.
#pragma once

#include <functional>
#include <string>

#include <lamina/frontend/frontend.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/pipeline/calibration/calibration_options.hpp>
#include <lamina/pipeline/run_record.hpp>
#include <lamina/sensors/recording.hpp>

namespace lamina {

/// What no file or topic stated, said once.
void note_assumed(const Recording& recording, Diagnostics& metrics);
/// Where a signal ended the run; `resumable`: it has a checkpoint to go on from.
void warn_of_end(const Recording& recording, bool resumable, RunRecord& record);
/// What makes the result doubtful, by the reader first: causes before consequences.
void warn_of_result(const std::string& input, const Recording& recording, const FrontEnd& front_end,
                    Diagnostics& metrics);
/// Online nothing is known of a scanner before the robot has driven: what a first look would have
/// corrected is said at the end. `again`: the recording, opened anew.
void warn_of_scanner(Recording& again, const CalibrationOptions& options,
                     const std::function<bool()>& ended, Diagnostics& metrics);

}  // namespace lamina
