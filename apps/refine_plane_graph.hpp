// `lamina refine FILE.planegraph`: the solver alone on a benchmark problem.
#pragma once

#include <filesystem>

namespace lamina::apps {

/// Solves (offline: the whole graph; online: the fixed-lag window over it), writes trajectory.txt
/// (the pose index as time), metrics.json and graph.g2o, and prints a line of figures.
int refine_plane_graph(const std::filesystem::path& file, const std::filesystem::path& output,
                       bool online, int window_keyframes);

}  // namespace lamina::apps
