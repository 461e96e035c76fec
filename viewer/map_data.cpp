// Planes, trajectories, metrics, evaluation and path as the page's JSON.
#include <lamina/viewer/map_data.hpp>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <lamina/models/error.hpp>
#include <lamina/models/trajectory.hpp>
#include <lamina/viewer/encode.hpp>
#include <lamina/viewer/image_data.hpp>

namespace lamina::viewer {
namespace {

using Json = nlohmann::ordered_json;
using Path = std::filesystem::path;

/// To a tenth of a millimetre (or of a millisecond): short text, and finer than anything drawn.
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

Json rounded_outline(const Json& outline) {
  Json points = Json::array();
  for (const auto& p : outline) {
    points.push_back({rounded(p.at(0).get<double>()), rounded(p.at(1).get<double>()),
                      rounded(p.at(2).get<double>())});
  }
  return points;
}

Json plane_data(const Json& plane) {
  Json out;
  out["id"] = plane.at("id").get<std::int64_t>();
  out["label"] = plane.at("label").get<std::string>();
  for (const char* key : {"rho", "theta", "phi", "sigma_rho", "sigma_angle", "area"}) {
    out[key] = plane.at(key).get<double>();
  }
  out["normal"] = rounded_outline(Json::array({plane.at("normal")})).at(0);
  out["observations"] = plane.at("observations").get<std::int64_t>();
  out["unobserved"] = plane.value("unobserved_directions", 0);
  Json outlines = Json::array();
  if (!plane.at("boundary").empty()) outlines.push_back(rounded_outline(plane.at("boundary")));
  if (plane.contains("more_boundaries")) {
    for (const auto& more : plane.at("more_boundaries")) outlines.push_back(rounded_outline(more));
  }
  out["outlines"] = outlines;
  return out;
}

Json planes_data(const Path& file) {
  const Json json = read_json(file);
  try {
    Json planes = Json::array();
    for (const auto& plane : json.at("planes")) planes.push_back(plane_data(plane));
    return planes;
  } catch (const nlohmann::json::exception& e) {
    throw Error(file.string() + ": expected the planes of a map (" + e.what() + ")");
  }
}

/// Times are given from `start` on, so that 32 bits hold them to a tenth of a millisecond.
Json trajectory_data(const Trajectory& trajectory, double start) {
  const std::size_t stride = thinning_stride(trajectory.size(), kMostPoses);
  std::vector<float> times, positions;
  const auto add = [&](const StampedPose& pose) {
    times.push_back(static_cast<float>(pose.stamp.seconds() - start));
    const Eigen::Vector3d p = pose.pose.translation();
    for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(p[k]));
  };
  for (std::size_t i = 0; i < trajectory.size(); i += stride) add(trajectory[i]);
  if (!trajectory.empty() && (trajectory.size() - 1) % stride != 0) add(trajectory.back());
  Json out;
  out["total"] = trajectory.size();
  out["count"] = times.size();
  out["length"] = trajectory.length();
  out["times"] = base64(times);
  out["positions"] = base64(positions);
  return out;
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

/// The text of a JSON object, member by member.
class ObjectText {
 public:
  void add(const std::string& key, const std::string& json) {
    text_ += (text_.empty() ? "\"" : ",\n\"") + key + "\":" + json;
  }
  void add(const std::string& key, const Json& json) {
    add(key, json.dump(-1, ' ', true, Json::error_handler_t::replace));
  }
  std::string text() const { return "{" + text_ + "}"; }

 private:
  std::string text_;
};

void add_tracks(ObjectText& data, const Path& folder) {
  std::optional<double> start;
  const auto add = [&](const char* key, const char* name) {
    if (!std::filesystem::exists(folder / name)) return;
    const auto trajectory = Trajectory::read_tum(folder / name);
    if (!start) start = trajectory.empty() ? 0.0 : trajectory.front().stamp.seconds();
    data.add(key, trajectory_data(trajectory, *start));
  };
  add("trajectory", "trajectory.txt");
  add("before", "trajectory_before.txt");
  if (std::filesystem::exists(folder / "evaluation.json")) {
    data.add("evaluation", evaluation_data(folder / "evaluation.json", start.value_or(0.0)));
  }
}

}  // namespace

std::string map_data(const Path& folder) {
  const auto there = [&](const char* name) { return std::filesystem::exists(folder / name); };
  if (!there("planes.json") && !there("trajectory.txt")) {
    throw Error(folder.string() +
                ": found neither planes.json nor trajectory.txt, expected a map's output folder");
  }
  ObjectText data;
  data.add("name", Json(folder_name(folder)));
  data.add("planes", there("planes.json") ? planes_data(folder / "planes.json") : Json::array());
  add_tracks(data, folder);
  if (there("metrics.json")) data.add("metrics", read_json(folder / "metrics.json"));
  if (there("grid/grid.yaml")) {
    if (const auto grid = grid_data(folder / "grid"); !grid.empty()) data.add("grid", grid);
  }
  if (there("occupancy.pgm")) data.add("occupancy", occupancy_data(folder / "occupancy.pgm"));
  if (there("surfels.ply")) data.add("surfels", surfel_data(folder / "surfels.ply"));
  if (there("path.csv")) data.add("path", path_data(folder / "path.csv"));
  return data.text();
}

}  // namespace lamina::viewer
