// The `lamina` program.
#include <lamina/apps/verbs.hpp>
#include <lamina/models/freed_memory.hpp>

int main(int argc, char** argv) {
  lamina::keep_freed_memory();
  return lamina::apps::run(argc, argv);
}
