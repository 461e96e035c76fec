// The JSON of a map under way.
#include <lamina/viewer/live_data.hpp>

#include <nlohmann/json.hpp>

#include <lamina/io/decimal_seconds.hpp>
#include <lamina/models/error.hpp>
#include <lamina/viewer/encode.hpp>
#include <lamina/viewer/parts.hpp>

namespace lamina::viewer {

std::string live_data(const LivePicture& picture) {
  const PlanarMap& map = picture.map;
  nlohmann::ordered_json live;
  live["doing"] = picture.doing;
  live["done"] = picture.done;
  live["total"] = picture.total;
  live["seconds"] = picture.seconds;
  ObjectText data;
  data.add("name", quoted(picture.name));
  data.add("live", live.dump());
  data.add("planes", planes_text(map.planes));
  const double start =
      map.trajectory.empty() ? 0 : io::decimal_seconds(map.trajectory.front().stamp);
  data.add("start", nlohmann::json(start).dump());
  data.add("trajectory", track_text(map.trajectory, start));
  if (!picture.keyframes.empty()) data.add("keyframes", keyframes_text(picture.keyframes));
  if (!map.surfels.empty()) {
    const std::size_t stride = thinning_stride(map.surfels.size(), kMostSurfels);
    std::vector<Surfel> thinned;
    for (std::size_t i = 0; i < map.surfels.size(); i += stride) thinned.push_back(map.surfels[i]);
    data.add("surfels", surfels_text(thinned, map.surfels.size()));
  }
  if (!picture.points_map.empty()) {
    data.add("points", points_text(picture.points_map, kMostPoints));
  }
  if (!picture.metrics.empty()) data.add("metrics", picture.metrics);
  return data.text();
}

std::string finished_data(const std::string& map_data, const std::string& folder, double seconds) {
  LAMINA_CHECK(!map_data.empty() && map_data.front() == '{');
  nlohmann::ordered_json live;
  live["doing"] = "finished";
  live["seconds"] = seconds;
  live["folder"] = folder;
  return "{\"live\":" + live.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + "," +
         map_data.substr(1);
}

}  // namespace lamina::viewer
