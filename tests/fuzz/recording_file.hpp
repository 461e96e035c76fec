// A fuzzer's input as a file of this process, read as a recording of ROS 2.
#pragma once

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include <lamina/models/error.hpp>
#include <lamina/sensors/ros2/ros2_source.hpp>
#include <lamina/sensors/ros2/storage.hpp>

#include "fuzz/fuzz_input.hpp"

namespace lamina::fuzz {

/// `open` takes the file's name. All is read twice, the second time without the first topic; the
/// counts of topics are no more than what can be in so many bytes.
template <class Open>
void read_recording(const std::uint8_t* data, std::size_t size, const Open& open) {
  static const std::string file =
      (std::filesystem::temp_directory_path() / ("lamina_fuzz_" + std::to_string(getpid())))
          .string();
  std::ofstream(file, std::ios::binary | std::ios::trunc) << text_of(data, size);
  try {
    const auto source = ros2::make_source(open(file));
    std::vector<std::string> names;
    for (const bag::Topic& topic : source->topics()) names.push_back(topic.name);
    for (int pass = 0; pass < 2; ++pass) {
      source->select(names);
      bag::Message message;
      while (source->next(message) != bag::Source::Status::kEnd) {
      }
      for (const std::string& problem : source->problems())
        demand(problem.find('\n') == std::string::npos);
      if (!names.empty()) names.erase(names.begin());
    }
  } catch (const Error&) {
  }
  std::remove(file.c_str());
}

}  // namespace lamina::fuzz
