// Options of parts, from those of the whole.
#include <lamina/pipeline/map_options.hpp>

namespace lamina {

std::map<std::string, std::string> chosen_topics(const MapOptions& options) {
  std::map<std::string, std::string> chosen;
  for (const auto& [role, topic] : options.topics) {
    if (!topic.empty()) chosen[role] = topic;
  }
  return chosen;
}

GridOptions grid_options(const MapOptions& options) {
  return {options.grid_resolution, options.robot, options.threads, options.no_return_is_free};
}

}  // namespace lamina
