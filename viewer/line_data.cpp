// Readers of g2o vertices, scans and edges.
#include <lamina/viewer/line_data.hpp>

#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string_view>

#include <lamina/models/error.hpp>
#include <lamina/viewer/parts.hpp>

namespace lamina::viewer {
namespace {

using Path = std::filesystem::path;

/// Calls `take` with each line that is no comment, and its number.
template <typename Take>
void for_each_line(const Path& file, Take&& take) {
  std::ifstream in(file);
  if (!in) throw Error(file.string() + ": cannot be opened");
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (!line.empty() && line[0] != '#') take(line, number);
  }
}

/// The numbers of a line `1,2.5,nan`; false when something else stands there.
bool numbers_of(std::string_view line, std::vector<double>& values) {
  values.clear();
  while (!line.empty()) {
    double value = 0;
    const auto [end, fault] = std::from_chars(line.data(), line.data() + line.size(), value);
    if (fault != std::errc()) return false;
    values.push_back(value);
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
    if (!line.empty() && line[0] == '\r') break;
    if (!line.empty() && line[0] != ',') return false;
    if (!line.empty()) line.remove_prefix(1);
  }
  return true;
}

std::string beginning(const std::string& line) {
  return "'" + line.substr(0, 40) + (line.size() > 40 ? "..." : "") + "'";
}

}  // namespace

std::vector<SE3> keyframes_of(const Path& g2o_file) {
  std::vector<SE3> poses;
  bool planes_begun = false;
  for_each_line(g2o_file, [&](const std::string& line, int number) {
    constexpr std::string_view kVertex = "VERTEX_SE3:QUAT ";
    planes_begun = planes_begun || line.rfind("VERTEX_PLANE ", 0) == 0;
    // Poses after the planes are places of sensors.
    if (planes_begun || line.compare(0, kVertex.size(), kVertex) != 0) return;
    std::istringstream text(line.substr(kVertex.size()));
    std::int64_t id = 0;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    if (!(text >> id >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w()) ||
        !(std::abs(q.norm() - 1) < 1e-3)) {
      throw input_error(g2o_file.string(), std::to_string(number), beginning(line),
                        "id, position and unit quaternion");
    }
    poses.emplace_back(SO3(q.normalized()), t);
  });
  return poses;
}

std::vector<Eigen::Vector3f> scan_points(const Path& csv_file, const Trajectory& path) {
  PointCloud cloud;
  std::vector<double> values;
  for_each_line(csv_file, [&](const std::string& line, int number) {
    if (!numbers_of(line, values) || values.size() < 5) {
      throw input_error(csv_file.string(), std::to_string(number), beginning(line),
                        "timestamp,angle_min,angle_increment,range_min,range_max,r0,...");
    }
    const auto T_map_body = path.at(Timestamp::from_seconds(values[0]));
    if (!T_map_body) return;
    for (std::size_t i = 5; i < values.size(); ++i) {
      const double r = values[i], angle = values[1] + values[2] * static_cast<double>(i - 5);
      if (!std::isfinite(r) || r <= 0 || r < values[3] || (values[4] > 0 && r > values[4]))
        continue;
      const Eigen::Vector3d end(r * std::cos(angle), r * std::sin(angle), 0);
      cloud.add((*T_map_body * end).cast<float>());
    }
  });
  return cloud.points();
}

std::vector<Eigen::Vector3f> edge_points(const Path& csv_file) {
  std::vector<Eigen::Vector3f> points;
  std::vector<double> values;
  for_each_line(csv_file, [&](const std::string& line, int number) {
    if (number == 1 && line[0] == 'x') return;
    if (!numbers_of(line, values) || values.size() < 3) {
      throw input_error(csv_file.string(), std::to_string(number), beginning(line), "x,y,z,sigma");
    }
    points.emplace_back(Eigen::Vector3d(values[0], values[1], values[2]).cast<float>());
  });
  return points;
}

WindowSeries window_series(const Path& csv_file) {
  WindowSeries series;
  std::vector<double> values;
  for_each_line(csv_file, [&](const std::string& line, int number) {
    if (number == 1 && line[0] == 't') return;
    if (!numbers_of(line, values) || values.size() < 4) {
      throw input_error(csv_file.string(), std::to_string(number), beginning(line),
                        "timestamp,keyframes,residuals,solve_ms");
    }
    series.times.push_back(values[0]);
    series.keyframes.push_back(values[1]);
    series.residuals.push_back(values[2]);
    series.solve_ms.push_back(values[3]);
  });
  return series;
}

}  // namespace lamina::viewer
