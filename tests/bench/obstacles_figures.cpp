// The laser scans of the document on negative obstacles, its figures 13 to 22, beside ours.
//   obstacles_figures FILE.svg
// Two scenes (a hole of 2 x 2 m before a wall, and without the wall), seen from above by a level
// camera 0.3 m above the floor: farthest point, virtual floor projection, both, and our scan.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <vector>

#include <fmt/format.h>

#include <lamina/frontend/depth/floor_frontend.hpp>
#include <lamina/frontend/obstacles/baseline_methods.hpp>
#include <lamina/frontend/obstacles/obstacle_scanner.hpp>

#include "bench/scene_camera.hpp"

using namespace lamina;

namespace {

constexpr double kScale = 36, kWide = 300, kHigh = 290;  // px a metre, of a panel

struct Panel {
  std::string title;
  ObstacleScan scan;
};

// Metres ahead (up) and to the left, of the body in the middle of the panel's foot.
struct Drawing {
  std::string text;
  double x0 = 0, y0 = 0;

  double x(const Eigen::Vector2d& p) const { return x0 + kWide / 2 - kScale * p.y(); }
  double y(const Eigen::Vector2d& p) const { return y0 + kHigh - 10 - kScale * p.x(); }
  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const char* style) {
    text += fmt::format("<line x1='{:.1f}' y1='{:.1f}' x2='{:.1f}' y2='{:.1f}' {}/>\n", x(a), y(a),
                        x(b), y(b), style);
  }
};

const char* colour(BeamCause cause) {
  switch (cause) {
    case BeamCause::kObstacle:
      return "#000000";
    case BeamCause::kHole:
      return "#d55e00";
    case BeamCause::kLedge:
      return "#0072b2";
    default:
      return "#b0b0b0";
  }
}

bool inside(const Eigen::Vector2d& p) {
  return p.x() > -0.1 && p.x() < kHigh / kScale - 0.5 && std::abs(p.y()) < kWide / kScale / 2;
}

void draw(Drawing& out, const Panel& panel, const sim::Scene& scene, const SE3& T_body_map) {
  out.text += fmt::format(
      "<rect x='{}' y='{}' width='{}' height='{}' fill='#ffffff' stroke='#d0d0d0'/>\n"
      "<text x='{}' y='{}' font-size='13' stroke='none'>{}</text>\n",
      out.x0, out.y0, kWide, kHigh, out.x0 + 8, out.y0 + 18, panel.title);
  for (const sim::HoleEdge& edge : scene.hole_edges()) {
    out.line((T_body_map * edge.from_map).head<2>(), (T_body_map * edge.to_map).head<2>(),
             "stroke='#009e73' stroke-width='2'");
  }
  std::map<std::string, std::string> points;
  for (std::size_t i = 0; i < panel.scan.size(); ++i) {
    if (panel.scan.cause[i] == BeamCause::kNone) continue;
    const double angle = panel.scan.angle(i), range = static_cast<double>(panel.scan.range[i]);
    const Eigen::Vector2d p(range * std::cos(angle), range * std::sin(angle));
    if (!inside(p)) continue;
    points[colour(panel.scan.cause[i])] += fmt::format("M{:.1f} {:.1f}h0", out.x(p), out.y(p));
  }
  for (const auto& [stroke, path] : points) {
    out.text += fmt::format("<path d='{}' stroke='{}'/>\n", path, stroke);
  }
}

// Beams over the rim that faces the robot, and those of them that report it within 0.3 m.
struct Reported {
  int beams = 0, within = 0;
};

Reported score(const ObstacleScan& scan, const sim::Scene& scene, const SE3& T_body_map) {
  Reported result;
  double from = 1e9, left = -1e9, right = 1e9;
  for (const sim::HoleEdge& edge : scene.hole_edges()) {
    for (const Eigen::Vector3d& end : {edge.from_map, edge.to_map}) {
      from = std::min(from, (T_body_map * end).x());
      left = std::max(left, (T_body_map * end).y());
      right = std::min(right, (T_body_map * end).y());
    }
  }
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double angle = scan.angle(i), y = from * std::tan(angle), range = from / std::cos(angle);
    if (y <= right || y >= left) continue;
    ++result.beams;
    result.within += scan.cause[i] != BeamCause::kNone &&
                     std::abs(static_cast<double>(scan.range[i]) - range) <= 0.3;
  }
  return result;
}

std::vector<Panel> scans(const DepthFrame& frame) {
  FloorFrontend frontend;
  const FloorResult floor = frontend.process(frame);
  DisparityImage disparities;
  fill_disparity(frame, disparities);
  const ScanView view(frame, disparities, floor.T_body_camera);
  const ScanOptions options;
  const ObstacleScan ours = ObstacleScanner(options).process(frame, floor);
  const ObstacleScan empty = ObstacleScan::empty(frame.stamp, ours.angle_min, ours.angle_increment,
                                                 ours.size(), ours.range_max);
  ObstacleScan farthest = empty, below = empty, positive = empty;
  document_farthest_point(view, options.document_tolerance_m, farthest);
  document_virtual_floor(view, options.document_tolerance_m, below);
  document_positive_scan(view, options.document_tolerance_m, options.robot_height_m, positive);
  return {{"farthest point of the floor", farthest},
          {"virtual floor projection", below},
          {"both (document)", combine(combine(farthest, below), positive)},
          {"contiguous floor (ours)", ours}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: obstacles_figures FILE.svg\n");
    return 2;
  }
  const sim::Parameters level_camera{{"effects.grazing", "false"}};
  const SE3 T_map_body;
  Drawing drawing;
  for (const char* scene : {"hole", "hole_no_wall"}) {
    SceneCamera camera(scene, level_camera, 7);
    drawing.x0 = 0;
    for (Panel& panel : scans(camera.frame(T_map_body, 0))) {
      const Reported r = score(panel.scan, camera.world.scene, T_map_body.inverse());
      std::printf("%-13s %-28s near edge reported by %d of %d beams\n", scene, panel.title.c_str(),
                  r.within, r.beams);
      panel.title = std::string(scene) + ": " + panel.title;
      draw(drawing, panel, camera.world.scene, T_map_body.inverse());
      drawing.x0 += kWide;
    }
    drawing.y0 += kHigh;
  }
  std::ofstream(argv[1]) << fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' viewBox='0 0 {0} {1}' "
      "font-family='sans-serif' stroke-width='2.5' stroke-linecap='round'>\n{2}</svg>\n",
      drawing.x0, drawing.y0, drawing.text);
  return 0;
}
