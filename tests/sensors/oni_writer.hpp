// Records the simulated camera to an .oni file through the stock recorder.
#pragma once

#include <string>

namespace lamina::test {

/// Throws std::runtime_error when OpenNI2 refuses.
void record_simulated_oni(const std::string& uri, const std::string& file, int frames);

}  // namespace lamina::test
