// The table of verbs: each file of apps/ adds one.
#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace lamina::apps {

/// `add` declares options on its subcommand and returns what to run after parsing; the returned
/// function gives the exit code.
struct Verb {
  std::string name, summary, example;
  std::function<std::function<int()>(CLI::App&)> add;
};

Verb map_verb();
Verb refine_verb();
Verb scan_verb();
Verb plan_verb();
Verb simulate_verb();
Verb evaluate_verb();
Verb info_verb();
Verb view_verb();
Verb export_verb();
Verb config_verb();

/// What the program was called with, a word after the other; set by run().
const std::string& command_line();

/// Exit codes of the program.
inline constexpr int kDone = 0, kFailed = 1, kUsage = 2;

/// Runs the program; never throws.
int run(int argc, const char* const* argv);

}  // namespace lamina::apps
