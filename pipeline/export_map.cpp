// The table of forms.
#include <lamina/pipeline/export_map.hpp>

#include <algorithm>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/grid_files.hpp>
#include <lamina/io/map_folder.hpp>
#include <lamina/models/error.hpp>

namespace lamina {

namespace fs = std::filesystem;

const std::vector<ExportFormat>& export_formats() {
  static const std::vector<ExportFormat> formats{
      {"keepout",
       "masks of nav2's keepout and speed filters",
       [](const fs::path& map, const fs::path& output) {
         io::write_filter_masks(output, io::read_map_grid(map));
       },
       {"keepout.yaml", "keepout.pgm", "speed.yaml", "speed.pgm"}}};
  return formats;
}

std::vector<fs::path> export_map(const fs::path& map, const std::string& format,
                                 const fs::path& output) {
  const auto& formats = export_formats();
  const auto found = std::find_if(formats.begin(), formats.end(),
                                  [&](const ExportFormat& f) { return f.name == format; });
  if (found == formats.end()) {
    std::string known;
    for (const ExportFormat& f : formats) known += (known.empty() ? "" : ", ") + f.name;
    throw Error("--to: found '" + format + "', expected one of: " + known);
  }
  io::require_map_folder(map);
  io::make_output_folder(output);
  found->write(map, output);
  std::vector<fs::path> written;
  for (const std::string& file : found->files) written.push_back(output / file);
  return written;
}

}  // namespace lamina
