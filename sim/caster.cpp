// Bounding volume hierarchy over faces and cylinders, and their exact intersections with rays.
#include <lamina/sim/caster.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <lamina/sim/mesh_caster.hpp>

namespace lamina::sim {

std::optional<double> cast_face(const Face& face, const Eigen::Vector3d& origin,
                                const Eigen::Vector3d& direction) {
  const Eigen::Vector3d& n = face.plane_map.normal();
  const double slope = n.dot(direction);
  if (slope == 0) {
    return std::nullopt;
  }
  const double range = -face.plane_map.signed_distance(origin) / slope;
  if (!(range > 0) || !std::isfinite(range)) {
    return std::nullopt;
  }
  const Eigen::Vector3d x = origin + range * direction;
  const std::size_t count = face.corners_map.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d& a = face.corners_map[i];
    const Eigen::Vector3d edge = face.corners_map[(i + 1) % count] - a;
    if (edge.cross(x - a).dot(n) < -1e-9 * edge.norm()) {
      return std::nullopt;
    }
  }
  return range;
}

std::optional<double> cast_cylinder(const Cylinder& c, const Eigen::Vector3d& origin,
                                    const Eigen::Vector3d& direction, double min_range) {
  const Eigen::Vector3d w = origin - c.base_map;
  const Eigen::Vector3d d = direction - direction.dot(c.axis_map) * c.axis_map;
  const Eigen::Vector3d o = w - w.dot(c.axis_map) * c.axis_map;
  const double A = d.squaredNorm(), B = d.dot(o), C = o.squaredNorm() - c.radius * c.radius;
  const double root = B * B - A * C;
  if (A < 1e-18 || root < 0) {
    return std::nullopt;
  }
  for (double sign : {-1.0, 1.0}) {
    const double range = (-B + sign * std::sqrt(root)) / A;
    const double along = (w + range * direction).dot(c.axis_map);
    if (range > min_range && along >= 0 && along <= c.length) {
      return range;
    }
  }
  return std::nullopt;
}

Caster::~Caster() = default;
Caster::Caster(Caster&&) noexcept = default;
Caster& Caster::operator=(Caster&&) noexcept = default;

Caster::Caster(const Scene& scene) : scene_(&scene) {
  const double inf = std::numeric_limits<double>::infinity();
  std::vector<Eigen::Array3d> centers;
  const auto add = [&](const Eigen::Array3d& low, const Eigen::Array3d& high) {
    lows_.push_back(low - 1e-9);
    highs_.push_back(high + 1e-9);
    centers.push_back(0.5 * (low + high));
  };
  for (const Face& face : scene.faces()) {
    Eigen::Array3d low = Eigen::Array3d::Constant(inf), high = -low;
    for (const Eigen::Vector3d& corner : face.corners_map) {
      low = low.min(corner.array());
      high = high.max(corner.array());
    }
    add(low, high);
  }
  for (const Cylinder& c : scene.cylinders()) {
    const Eigen::Array3d a = c.base_map.array(), b = (c.base_map + c.length * c.axis_map).array();
    add(a.min(b) - c.radius, a.max(b) + c.radius);
  }
  order_.resize(centers.size());
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.reserve(2 * centers.size() + 1);
  nodes_.push_back({});
  nodes_[0].count = static_cast<std::int32_t>(order_.size());
  build(0, centers);
  if (!scene.meshes().empty()) {
    meshes_ = std::make_unique<MeshCaster>(scene.meshes());
  }
}

void Caster::bound(Node& node) const {
  const double inf = std::numeric_limits<double>::infinity();
  node.low.setConstant(inf);
  node.high.setConstant(-inf);
  for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
    const std::size_t s = static_cast<std::size_t>(order_[static_cast<std::size_t>(i)]);
    node.low = node.low.min(lows_[s]);
    node.high = node.high.max(highs_[s]);
  }
}

void Caster::build(std::int32_t index, std::vector<Eigen::Array3d>& centers) {
  Node& node = nodes_[static_cast<std::size_t>(index)];
  bound(node);
  if (node.count <= 2) {
    return;
  }
  // Median split along the longest extent of the bounds; ties by number, so the tree is one.
  Eigen::Index axis = 0;
  (node.high - node.low).maxCoeff(&axis);
  const auto begin = order_.begin() + node.first;
  std::sort(begin, begin + node.count, [&](std::int32_t a, std::int32_t b) {
    const double ca = centers[static_cast<std::size_t>(a)][axis];
    const double cb = centers[static_cast<std::size_t>(b)][axis];
    return ca < cb || (ca == cb && a < b);
  });
  const std::int32_t half = node.count / 2, first = node.first, count = node.count;
  const std::int32_t left = static_cast<std::int32_t>(nodes_.size());
  node.left = left;
  nodes_.push_back({});
  nodes_.back().first = first;
  nodes_.back().count = half;
  nodes_.push_back({});
  nodes_.back().first = first + half;
  nodes_.back().count = count - half;
  build(left, centers);
  build(left + 1, centers);
}

bool Caster::hit_surface(std::int32_t surface, const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction, double min_range, Hit& best) const {
  const std::size_t s = static_cast<std::size_t>(surface), faces = scene_->faces().size();
  const std::optional<double> range =
      s < faces ? cast_face(scene_->faces()[s], origin, direction)
                : cast_cylinder(scene_->cylinders()[s - faces], origin, direction, min_range);
  // Equal ranges go to the lower number: the answer does not depend on the order of the tree.
  if (!range || *range <= min_range || *range > best.range ||
      (*range == best.range && best.surface >= 0 && surface > best.surface)) {
    return false;
  }
  best.range = *range;
  best.surface = surface;
  return true;
}

namespace {

template <class Box>
bool misses_box(const Box& box, const Eigen::Vector3d& origin, const Eigen::Array3d& inverse,
                double enter, double leave) {
  for (int k = 0; k < 3; ++k) {
    const double a = (box.low[k] - origin[k]) * inverse[k];
    const double b = (box.high[k] - origin[k]) * inverse[k];
    // Written so that a NaN (0 times infinity, a ray in the box's side) does not exclude.
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(b, a));
  }
  return enter > leave;
}

// Of a face or a cylinder, on either side.
Eigen::Vector3d normal_at(const Scene& scene, std::int32_t surface, const Eigen::Vector3d& p_map) {
  const std::size_t s = static_cast<std::size_t>(surface), faces = scene.faces().size();
  if (s < faces) return scene.faces()[s].plane_map.normal();
  const Cylinder& c = scene.cylinders()[s - faces];
  const Eigen::Vector3d x = p_map - c.base_map;
  return (x - x.dot(c.axis_map) * c.axis_map).normalized();
}

}  // namespace

std::optional<Hit> Caster::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                double min_range, double max_range) const {
  Hit best;
  best.range = max_range;
  const Eigen::Array3d inverse = direction.array().inverse();
  std::int32_t stack[64];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[static_cast<std::size_t>(stack[--top])];
    if (misses_box(node, origin, inverse, min_range, best.range)) {
      continue;
    }
    if (node.left >= 0) {
      stack[top++] = node.left;
      stack[top++] = node.left + 1;
      continue;
    }
    for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
      hit_surface(order_[static_cast<std::size_t>(i)], origin, direction, min_range, best);
    }
  }
  if (meshes_) {
    if (const auto hit = cast_meshes(origin, direction, min_range, best.range)) {
      return hit;
    }
  }
  if (best.surface < 0) {
    return std::nullopt;
  }
  best.normal_map = normal_at(*scene_, best.surface, origin + best.range * direction);
  if (best.normal_map.dot(direction) > 0) {
    best.normal_map = -best.normal_map;
  }
  return best;
}

std::optional<Hit> Caster::cast_meshes(const Eigen::Vector3d& origin,
                                       const Eigen::Vector3d& direction, double min_range,
                                       double max_range) const {
  if (!meshes_) {
    return std::nullopt;
  }
  std::optional<Hit> hit = meshes_->cast(origin, direction, min_range, max_range);
  if (hit) {
    hit->surface += static_cast<std::int32_t>(scene_->faces().size() + scene_->cylinders().size());
  }
  return hit;
}

int Caster::plane_of(std::int32_t surface) const {
  return surface >= 0 && static_cast<std::size_t>(surface) < scene_->faces().size()
             ? scene_->faces()[static_cast<std::size_t>(surface)].plane_id
             : -1;
}

}  // namespace lamina::sim
