// Planes, trajectories, metrics, evaluation and path as the page's JSON.
#include <lamina/viewer/map_data.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <lamina/io/decimal_seconds.hpp>
#include <lamina/io/map_files.hpp>
#include <lamina/models/error.hpp>
#include <lamina/models/trajectory.hpp>
#include <lamina/viewer/encode.hpp>
#include <lamina/viewer/image_data.hpp>
#include <lamina/viewer/line_data.hpp>
#include <lamina/viewer/parts.hpp>

namespace lamina::viewer {
namespace {

using Json = nlohmann::ordered_json;
using Path = std::filesystem::path;

/// To a tenth of a millimetre or of a millisecond.
double rounded(double value) { return std::round(value * 1e4) / 1e4; }

Json read_json(const Path& file) {
  std::ifstream in(file);
  if (!in) throw Error(file.string() + ": cannot be opened");
  try {
    return Json::parse(in);
  } catch (const nlohmann::json::exception& e) {
    throw Error(file.string() + ": found no JSON (" + e.what() + ")");
  }
}

/// evaluation.json with its long lists thinned and its times from `start` on.
Json evaluation_data(const Path& file, double start) {
  Json json = read_json(file);
  if (!json.contains("trajectory") || !json.at("trajectory").is_object()) return json;
  Json& track = json.at("trajectory");
  for (const char* key : {"times", "errors_m"}) {
    if (!track.contains(key) || !track.at(key).is_array()) continue;
    const Json& list = track.at(key);
    const double offset = std::string(key) == "times" ? start : 0.0;
    const std::size_t stride = thinning_stride(list.size(), kMostPoses);
    Json thin = Json::array();
    for (std::size_t i = 0; i < list.size(); i += stride) {
      const Json& value = list[i];
      thin.push_back(value.is_number() ? Json(rounded(value.get<double>() - offset)) : Json());
    }
    track[key] = thin;
  }
  return json;
}

/// Thinned by the largest of each stretch, so that no peak is lost.
Json window_data(const Path& file, double start) {
  const WindowSeries series = window_series(file);
  const std::size_t stride = thinning_stride(series.times.size(), kMostWindows);
  Json out{{"times", Json::array()},
           {"keyframes", Json::array()},
           {"residuals", Json::array()},
           {"solve_ms", Json::array()}};
  for (std::size_t i = 0; i < series.times.size(); i += stride) {
    const auto most = [&](const std::vector<double>& list) {
      const auto first = list.begin() + static_cast<std::ptrdiff_t>(i);
      const auto n = static_cast<std::ptrdiff_t>(std::min(stride, list.size() - i));
      return rounded(*std::max_element(first, first + n));
    };
    out["times"].push_back(rounded(series.times[i] - start));
    out["keyframes"].push_back(most(series.keyframes));
    out["residuals"].push_back(most(series.residuals));
    out["solve_ms"].push_back(most(series.solve_ms));
  }
  return out;
}

Json path_data(const Path& file) {
  std::ifstream in(file);
  std::string line;
  Json points = Json::array();
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line[0] == '#' || line[0] == 'x') continue;
    std::istringstream text(line);
    double x = 0, y = 0;
    char comma = 0;
    if (!(text >> x >> comma >> y) || comma != ',') {
      throw input_error(file.string(), std::to_string(number), "'" + line + "'", "x,y");
    }
    points.push_back({x, y});
  }
  return points;
}

std::string folder_name(const Path& folder) {
  const Path whole = std::filesystem::absolute(folder).lexically_normal();
  return (whole.has_filename() ? whole.filename() : whole.parent_path().filename()).string();
}

std::string dump(const Json& json) {
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

/// Trajectory (given back), path before refinement, evaluation: their times count from the first
/// pose on.
Trajectory add_tracks(ObjectText& data, const Path& folder) {
  std::optional<double> start;
  Trajectory path;
  const auto add = [&](const char* key, const char* name) {
    if (!std::filesystem::exists(folder / name)) return;
    const auto trajectory = Trajectory::read_tum(folder / name);
    if (!start) start = trajectory.empty() ? 0.0 : io::decimal_seconds(trajectory.front().stamp);
    data.add(key, track_text(trajectory, *start));
    if (path.empty()) path = trajectory;
  };
  add("trajectory", "trajectory.txt");
  add("before", "trajectory_before.txt");
  data.add("start", dump(Json(start.value_or(0.0))));
  if (std::filesystem::exists(folder / "evaluation.json")) {
    data.add("evaluation", dump(evaluation_data(folder / "evaluation.json", start.value_or(0.0))));
  }
  if (std::filesystem::exists(folder / "window.csv")) {
    data.add("window", dump(window_data(folder / "window.csv", start.value_or(0.0))));
  }
  return path;
}

}  // namespace

std::string map_data(const Path& folder) {
  const auto there = [&](const char* name) { return std::filesystem::exists(folder / name); };
  if (!there("planes.json") && !there("trajectory.txt")) {
    throw Error(folder.string() +
                ": found neither planes.json nor trajectory.txt, expected a map's output folder");
  }
  ObjectText data;
  data.add("name", quoted(folder_name(folder)));
  data.add("planes",
           there("planes.json") ? planes_text(io::read_planes_json(folder / "planes.json")) : "[]");
  const Trajectory path = add_tracks(data, folder);
  if (there("graph.g2o")) {
    data.add("keyframes", keyframes_text(keyframes_of(folder / "graph.g2o")));
  }
  if (there("metrics.json")) data.add("metrics", dump(read_json(folder / "metrics.json")));
  if (there("grid/grid.yaml")) {
    if (const auto grid = grid_data(folder / "grid"); !grid.empty()) data.add("grid", grid);
  }
  if (there("occupancy.pgm")) data.add("occupancy", occupancy_data(folder / "occupancy.pgm"));
  if (there("surfels.ply")) data.add("surfels", surfel_data(folder / "surfels.ply"));
  if (there("scans.csv")) {
    data.add("points", points_text(scan_points(folder / "scans.csv", path), kMostPoints));
  }
  if (there("edges.csv")) {
    data.add("edges", points_text(edge_points(folder / "edges.csv"), kMostEdges));
  }
  if (there("path.csv")) data.add("path", dump(path_data(folder / "path.csv")));
  return data.text();
}

}  // namespace lamina::viewer
