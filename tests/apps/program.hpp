// Runs the program itself: as people do.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace lamina::program {

using Path = std::filesystem::path;

/// A folder of this test program's own.
inline Path scratch() {
  static const Path folder = [] {
    Path p = Path(::testing::TempDir()) / ("lamina_run_" + std::to_string(::getpid()));
    std::filesystem::create_directories(p);
    return p;
  }();
  return folder;
}

/// Starts the program; `log`: where stderr goes, `out`: stdout.
inline pid_t start(const std::vector<std::string>& arguments, const Path& log = "/dev/null",
                   const Path& out = "/dev/null") {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), 1);
  ::dup2(::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), 2);
  std::vector<std::string> all{LAMINA_BINARY_DIR "/lamina"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (auto& a : all) argv.push_back(a.data());
  argv.push_back(nullptr);
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

/// Exit code; minus the signal when killed.
inline int wait_for(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

/// Waits until the file is there, a minute at most: sanitizers and busy machines are slow.
inline void await(const Path& file) {
  for (int i = 0; i < 60000 && !std::filesystem::exists(file); ++i) ::usleep(1000);
}

inline int run(const std::vector<std::string>& arguments, const Path& log = "/dev/null",
               const Path& out = "/dev/null") {
  return wait_for(start(arguments, log, out));
}

inline std::string text_of(const Path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Ten seconds of the furnished room: camera, lidar, wheels.
inline Path room(int seed) {
  const Path folder = scratch() / ("room" + std::to_string(seed));
  if (!std::filesystem::exists(folder / "scans.csv")) {
    EXPECT_EQ(run({"simulate", "room", "--output", folder, "--seed", std::to_string(seed),
                   "--duration", "10", "--quiet"}),
              0);
  }
  return folder;
}

/// Its map, made once.
inline Path mapped(int seed) {
  const Path folder = scratch() / ("map" + std::to_string(seed));
  if (!std::filesystem::exists(folder / "report.html")) {
    EXPECT_EQ(run({"map", room(seed), "--output", folder, "--quiet"}), 0);
  }
  return folder;
}

}  // namespace lamina::program
