// Settings of a map: files, assignments, preset.
#include <lamina/apps/mapping.hpp>
#include <lamina/apps/preset.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {

Settings settings_of(const MapRequest& request, const Calibration* sensors) {
  const auto all_over = [&request](Settings settings) {
    if (request.config) load(settings, *request.config);
    for (const auto& assignment : request.assignments) set_assignment(settings, assignment);
    if (request.preset) set(settings, "preset", *request.preset, "--preset");
    if (request.seed) settings.seed = *request.seed;
    if (request.threads) settings.threads = *request.threads;
    const auto wrong = problems(settings);
    if (!wrong.empty()) throw Error("settings: " + wrong.front());
    return settings;
  };
  const Settings asked = all_over({});
  const Preset* preset = find_preset(asked.preset);
  if (preset == nullptr && sensors) preset = &preset_for(*sensors, asked.scan_odometry.max_tilt);
  if (preset == nullptr) return asked;
  Settings base;
  apply(*preset, base);
  Settings settings = all_over(std::move(base));
  settings.preset = preset->name;
  return settings;
}

}  // namespace lamina::apps
