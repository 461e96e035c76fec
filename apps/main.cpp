// The `lamina` program.
#include <lamina/apps/verbs.hpp>

int main(int argc, char** argv) { return lamina::apps::run(argc, argv); }
