// The names that figures have in metrics.json and sessions.
#pragma once

#include <map>
#include <string>

#include <lamina/models/diagnostics.hpp>

namespace lamina::io {

/// Those that are known, by name.
std::map<std::string, double> by_name(const Figures& figures);
/// The figures of these names; other names are of a later version and left out.
Figures figures_of(const std::map<std::string, double>& named);
/// Adds what `more` knows, each to the figure of the same name.
void add(Figures& to, const Figures& more);

}  // namespace lamina::io
