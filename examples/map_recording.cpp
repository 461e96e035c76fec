// Maps a recording as `lamina map INPUT --output OUTPUT` does: the same files but report.html.
#include <cstdio>

#include <lamina/lamina.hpp>

int main(int argc, char** argv) try {
  if (argc != 3) return std::fputs("usage: map_recording INPUT OUTPUT\n", stderr), 2;
  lamina::MapRequest request;
  request.input = argv[1];
  request.output = argv[2];
  const auto [recording, options] = lamina::requested(request);
  const lamina::MapResult result = lamina::map(recording, options);
  std::fputs(lamina::write_results(argv[2], result).summary.c_str(), stdout);
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
