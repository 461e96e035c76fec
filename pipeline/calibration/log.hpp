// Lines for people about a run, of a library that prints nothing by itself.
#pragma once

namespace spdlog {
class logger;
}

namespace lamina {

/// The logger that the program registered as "lamina" (spdlog::register_logger or
/// set_default_logger); where there is none, one that drops every line. Callers include
/// <spdlog/spdlog.h>.
spdlog::logger& run_log();

}  // namespace lamina
