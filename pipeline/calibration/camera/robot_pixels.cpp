// Depths of each cell of pixels, by heading.
#include <lamina/pipeline/calibration/camera/robot_pixels.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <lamina/models/median.hpp>

namespace lamina {
namespace {

struct RobotPixelsOptions {
  int columns = 160;            ///< of cells over an image: a few pixels each
  double heading = 0.3;         ///< rad: images of one heading count as one
  std::size_t headings = 4;     ///< at least: by fewer, walls pass for the robot
  double steady = 0.85;         ///< share of headings in which a cell has its usual depth
  double tolerance = 0.02;      ///< of the depth, which is alike so far, beside its noise
  double sigmas = 3;            ///< of the stated noise, likewise
  double moved = 0.2;           ///< of the depth: a point's way that shows what is behind it
  double nearer = 0.8;          ///< of the ground's depth: images bend by less
  std::size_t views = 6;        ///< in a row that see the same place of the world
  double least_share = 0.0025;  ///< of the image: smaller ones do no harm
};

// Cells of side x side pixels; a cell is seen by the pixel in its middle.
struct Cells {
  explicit Cells(const DepthFrame& like, int across)
      : side(std::max(1, like.width() / across)),
        columns(like.width() / side),
        rows(like.height() / side) {}
  int u(int column) const { return column * side + side / 2; }
  int v(int row) const { return row * side + side / 2; }
  std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row * columns + column);
  }
  int side, columns, rows;
};

using Headings = std::map<long, std::vector<const DepthFrame*>>;

Headings by_heading(const std::vector<PosedImage>& images, double apart) {
  Headings all;
  const DepthFrame& like = *images.front().frame;
  for (const PosedImage& image : images) {
    if (image.frame->width() != like.width() || image.frame->height() != like.height()) continue;
    const double yaw = image.T_odom_body.so3().log().z();
    all[std::lround(yaw / apart)].push_back(image.frame);
  }
  return all;
}

double noise_of(const DepthFrame& like, double z, double share) {
  const double sigma = like.camera.noise.sigma_depth(z) + like.camera.noise.quantisation(z);
  return std::max(share * z, std::isfinite(sigma) ? RobotPixelsOptions().sigmas * sigma : 0.0);
}

// The depth (m) that a pixel has in nearly all headings; 0: none.
double steady_depth(const Headings& headings, int u, int v, const RobotPixelsOptions& options) {
  std::vector<double> all;
  for (const auto& [heading, frames] : headings) {
    for (const DepthFrame* frame : frames) {
      if (frame->raw_at(u, v) > 0) all.push_back(frame->depth_m(u, v));
    }
  }
  if (all.empty()) return 0;

  const double usual = median(all);
  const double noise = noise_of(*headings.begin()->second.front(), usual, options.tolerance);
  double share = 0;
  for (const auto& [heading, frames] : headings) {
    const auto alike = std::count_if(frames.begin(), frames.end(), [&](const DepthFrame* frame) {
      return std::abs(frame->depth_m(u, v) - usual) < noise;
    });
    share += static_cast<double>(alike) / static_cast<double>(frames.size());
  }
  return share > options.steady * static_cast<double>(headings.size()) ? usual : 0;
}

// Part of a level surface: pixels above or below it have the depth that one gives them.
bool is_level(const std::vector<double>& depths, const Cells& cells, int column, int row,
              const DepthFrame& like, const Eigen::Vector3d& up) {
  const CameraModel& c = like.camera.camera;
  const auto height = [&](int at) {  // of a ray, for each metre of depth
    return up.dot(Eigen::Vector3d((cells.u(column) - c.cx) / c.fx, (cells.v(at) - c.cy) / c.fy, 1));
  };
  const double z = depths[cells.at(column, row)];
  const int away = std::max(1, cells.rows / 20);
  for (const int other : {row - away, row + away}) {
    if (other < 0 || other >= cells.rows) continue;
    const double there = depths[cells.at(column, other)];
    if (there > 0 && std::abs(there * height(other) - z * height(row)) <
                         RobotPixelsOptions().tolerance * std::abs(z * height(row)))
      return true;
  }
  return false;
}

// The depth of ground that is level, where a cell looks down; else endless.
double ground_depth(const Cells& cells, int column, int row, const DepthFrame& like,
                    const SE3& T_body_camera) {
  const CameraModel& c = like.camera.camera;
  const Eigen::Vector3d ray((cells.u(column) - c.cx) / c.fx, (cells.v(row) - c.cy) / c.fy, 1);
  const double down = -(T_body_camera.so3() * ray).z();
  return down > 0 ? T_body_camera.translation().z() / down : HUGE_VAL;
}

// Looks at places where a point would be if it stood still in the world.
struct Looks {
  std::size_t through = 0, all = 0;  // the world is seen behind it; anything is seen
  bool of_robot() const { return 2 * through > all; }
};

// A point of the camera, carried to the next views.
void look_again(const std::vector<PosedImage>& images, const SE3& T_body_camera,
                const Eigen::Vector3d& point_camera, const RobotPixelsOptions& options,
                Looks& looks) {
  for (std::size_t from = 0; from < images.size(); ++from) {
    for (std::size_t to = from + 1; to < std::min(images.size(), from + options.views); ++to) {
      const DepthFrame& image = *images[to].frame;
      const Eigen::Vector3d p = (images[to].T_odom_body * T_body_camera).inverse() *
                                (images[from].T_odom_body * T_body_camera * point_camera);
      if (!(p.z() > 0) || (p - point_camera).norm() < options.moved * point_camera.z()) continue;
      const CameraModel& c = image.camera.camera;
      const long u = std::lround(c.fx * p.x() / p.z() + c.cx);
      const long v = std::lround(c.fy * p.y() / p.z() + c.cy);
      if (u < 0 || v < 0 || u >= image.width() || v >= image.height()) continue;
      const double z = image.depth_m(static_cast<int>(u), static_cast<int>(v));
      if (!(z > 0)) continue;
      ++looks.all;
      looks.through += z > p.z() + noise_of(image, p.z(), options.tolerance) ? 1 : 0;
    }
  }
}

// The marked cells that hang together with the first of `open`, which is emptied.
std::vector<std::size_t> part_of(std::vector<std::size_t> open, std::vector<bool>& left,
                                 const Cells& cells) {
  std::vector<std::size_t> part;
  while (!open.empty()) {
    const std::size_t at = open.back();
    open.pop_back();
    if (!left[at]) continue;
    left[at] = false;
    part.push_back(at);
    const int column = static_cast<int>(at) % cells.columns,
              row = static_cast<int>(at) / cells.columns;
    if (column > 0) open.push_back(at - 1);
    if (column + 1 < cells.columns) open.push_back(at + 1);
    if (row > 0) open.push_back(cells.at(column, row - 1));
    if (row + 1 < cells.rows) open.push_back(cells.at(column, row + 1));
  }
  return part;
}

// Parts that the world is not seen behind are the world's own.
void drop_world(const std::vector<PosedImage>& images, const SE3& T_body_camera,
                const std::vector<double>& depths, const Cells& cells,
                const RobotPixelsOptions& options, std::vector<bool>& marked) {
  const CameraModel& c = images.front().frame->camera.camera;
  std::vector<bool> left = marked;
  for (std::size_t first = 0; first < marked.size(); ++first) {
    const std::vector<std::size_t> part = part_of({first}, left, cells);
    Looks looks;
    for (const std::size_t at : part) {
      const int column = static_cast<int>(at) % cells.columns,
                row = static_cast<int>(at) / cells.columns;
      const Eigen::Vector3d ray((cells.u(column) - c.cx) / c.fx, (cells.v(row) - c.cy) / c.fy, 1);
      look_again(images, T_body_camera, depths[at] * ray, options, looks);
    }
    if (looks.of_robot()) continue;
    for (const std::size_t at : part) marked[at] = false;
  }
}

// All pixels of marked cells and of those about them.
std::vector<bool> pixels_of(const std::vector<bool>& marked, const Cells& cells,
                            const DepthFrame& like) {
  std::vector<bool> pixels(like.raw.size());
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns; ++column) {
      if (!marked[cells.at(column, row)]) continue;
      const int v_end = std::min(like.height(), (row + 3) * cells.side);
      const int u_end = std::min(like.width(), (column + 3) * cells.side);
      for (int v = std::max(0, (row - 2) * cells.side); v < v_end; ++v) {
        for (int u = std::max(0, (column - 2) * cells.side); u < u_end; ++u)
          pixels[static_cast<std::size_t>(v * like.width() + u)] = true;
      }
    }
  }
  return pixels;
}

}  // namespace

std::vector<bool> robot_pixels(const std::vector<PosedImage>& images, const SE3& T_body_camera) {
  const RobotPixelsOptions options;
  if (images.empty()) return {};
  const Headings headings = by_heading(images, options.heading);
  if (headings.size() < options.headings) return {};
  const DepthFrame& like = *images.front().frame;
  const Cells cells(like, options.columns);
  std::vector<double> depths;
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns; ++column)
      depths.push_back(steady_depth(headings, cells.u(column), cells.v(row), options));
  }
  const Eigen::Vector3d up = T_body_camera.so3().inverse() * Eigen::Vector3d::UnitZ();
  std::vector<bool> marked(depths.size());
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns; ++column) {
      const std::size_t i = cells.at(column, row);
      const double ground = ground_depth(cells, column, row, like, T_body_camera);
      marked[i] = depths[i] > 0 && depths[i] < options.nearer * ground &&
                  !is_level(depths, cells, column, row, like, up);
    }
  }
  drop_world(images, T_body_camera, depths, cells, options, marked);
  const auto all = static_cast<double>(std::count(marked.begin(), marked.end(), true));
  if (all < options.least_share * static_cast<double>(marked.size())) return {};
  return pixels_of(marked, cells, like);
}

}  // namespace lamina
