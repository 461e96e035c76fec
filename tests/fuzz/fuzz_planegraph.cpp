// .planegraph files: what reads is finite and names only poses and planes that are there.
#include <lamina/models/error.hpp>
#include <lamina/pipeline/evaluation/plane_graph.hpp>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  try {
    const lamina::PlaneGraph problem =
        lamina::parse_plane_graph(lamina::fuzz::text_of(data, size), "p.planegraph");
    const int poses = static_cast<int>(problem.initial_map_body.size());
    for (const auto& pose : problem.initial_map_body) demand(pose.matrix().allFinite());
    for (const auto& step : problem.odometry) {
      demand(step.from >= 0 && step.from < poses && step.to >= 0 && step.to < poses);
      demand(step.T_from_to.matrix().allFinite());
    }
    for (const auto& seen : problem.observations) {
      demand(seen.pose >= 0 && seen.pose < poses);
      demand(seen.plane >= 0 && seen.plane < problem.plane_count);
      demand(seen.moments_body.mean().allFinite());
    }
  } catch (const lamina::Error&) {
  }
  return 0;
}
