// sample_report DIR: writes the sample map and its report there, for the check in a browser.
#include <cstdio>
#include <exception>

#include <lamina/viewer/report.hpp>

#include "viewer/sample_map.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    lamina::viewer::write_sample_map(argv[1]);
    lamina::viewer::write_report(argv[1]);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
