// Random worlds by random cameras and scanners: nothing hangs, breaks a promise or is no number.
#include <cstdio>
#include <span>

#include "fuzz/fuzz_input.hpp"
#include "support/frontend_draws.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  constexpr double kLongestStep = 1;  // s of the thread's own time, sanitizers and all
  lamina::Draws draws(std::span(data + 1, size - 1));
  const lamina::DrawResult result =
      data[0] % 2 == 0 ? lamina::draw_images(draws) : lamina::draw_scans(draws);
  if (!result.broken.empty()) std::fprintf(stderr, "broken: %s\n", result.broken.c_str());
  if (result.longest_step_s > kLongestStep)
    std::fprintf(stderr, "a step took %.2f s\n", result.longest_step_s);
  lamina::fuzz::demand(result.broken.empty() && result.longest_step_s <= kLongestStep);
  return 0;
}
