// The only file of the floor front-end that knows PCL.
#include <lamina/frontend/depth/cloud_planes.hpp>

#include <pcl/filters/crop_box.h>
#include <pcl/filters/extract_indices.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <chrono>
#include <cmath>
#include <map>

#include <lamina/models/checked_cast.hpp>
#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
constexpr double kDegree = M_PI / 180;
// Clouds come without a noise model: the Kinect's, the noisier of the document's two sensors,
// with half a centimetre for near points [Khoshelham2012].
double sigma_at(double range) { return std::max(0.005, 1.425e-3 * range * range); }

struct CloudPlane {
  Moments moments;  ///< body frame of the prior, weights 1/sigma^2
  Plane plane;
  std::vector<Eigen::Vector3d> points;
};

Cloud::Ptr crop(const CloudFrame& frame, const SE3& T_body_sensor, const FloorOptions& options) {
  Cloud::Ptr all(new Cloud);
  const Eigen::Matrix3f R = T_body_sensor.so3().matrix().cast<float>();
  const Eigen::Vector3f t = T_body_sensor.translation().cast<float>();
  for (const Eigen::Vector3f& p : frame.points_sensor) {
    if (!p.allFinite() || p.squaredNorm() < 1e-8F) continue;
    const Eigen::Vector3f q = R * p + t;
    all->push_back({q.x(), q.y(), q.z()});
  }
  pcl::CropBox<pcl::PointXYZ> box;
  const float half = 0.5F * static_cast<float>(options.roi_m[1]);
  box.setMin({0, -half, -static_cast<float>(options.roi_depth_below_m), 1});
  box.setMax({static_cast<float>(options.roi_m[0]), half, static_cast<float>(options.roi_m[2]), 1});
  box.setInputCloud(all);
  Cloud::Ptr inside(new Cloud);
  box.filter(*inside);
  return inside;
}

Cloud::Ptr without_outliers(const Cloud::Ptr& cloud, double alpha) {
  constexpr int kNeighbours = 12;
  if (cloud->size() <= kNeighbours) return Cloud::Ptr(new Cloud);
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setMeanK(kNeighbours);
  filter.setStddevMulThresh(alpha);
  filter.setInputCloud(cloud);
  Cloud::Ptr kept(new Cloud);
  filter.filter(*kept);
  return kept;
}

CloudPlane collect(const Cloud& cloud, const pcl::PointIndices& inliers,
                   const Eigen::Vector3d& sensor) {
  CloudPlane found;
  for (const int i : inliers.indices) {
    const Eigen::Vector3d p = cloud[static_cast<std::size_t>(i)].getVector3fMap().cast<double>();
    const double sigma = sigma_at((p - sensor).norm());
    found.moments.add(p, 1 / (sigma * sigma));
    found.points.push_back(p);
  }
  return found;
}

// One level of the recursion after the other; the first looks for the floor's prior normal.
std::vector<CloudPlane> recurse(Cloud::Ptr rest, const Eigen::Vector3d& sensor,
                                const FloorOptions& options) {
  std::vector<CloudPlane> found;
  constexpr std::size_t kLeast = 60;
  for (int step = 0; step < options.recursion_limit && rest->size() >= kLeast; ++step) {
    double range = 0;
    for (const auto& p : *rest) range += (p.getVector3fMap().cast<double>() - sensor).norm();
    range /= static_cast<double>(rest->size());
    pcl::SACSegmentation<pcl::PointXYZ> segmentation;  // not random: PCL's fixed seed
    segmentation.setOptimizeCoefficients(true);
    segmentation.setModelType(step == 0 ? pcl::SACMODEL_PERPENDICULAR_PLANE : pcl::SACMODEL_PLANE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setAxis(Eigen::Vector3f::UnitZ());
    segmentation.setEpsAngle(options.prior_cone_deg * kDegree);
    segmentation.setMaxIterations(100);
    segmentation.setDistanceThreshold(2.5 * sigma_at(range));
    segmentation.setInputCloud(rest);
    pcl::PointIndices::Ptr inliers(new pcl::PointIndices);
    pcl::ModelCoefficients coefficients;
    segmentation.segment(*inliers, coefficients);
    if (inliers->indices.size() < kLeast) {
      if (step == 0) continue;  // no floor here; other planes perhaps
      break;
    }
    CloudPlane plane = collect(*rest, *inliers, sensor);
    if (const auto fit = plane.moments.fit_plane(sensor, 1.0)) {
      plane.plane = fit->plane;
      found.push_back(std::move(plane));
    }
    pcl::ExtractIndices<pcl::PointXYZ> extract;
    extract.setInputCloud(rest);
    extract.setIndices(inliers);
    extract.setNegative(true);
    Cloud::Ptr left(new Cloud);
    extract.filter(*left);
    rest = left;
  }
  return found;
}

// Sections' planes that are one plane where both have their points.
void merge_into(std::vector<CloudPlane>& planes, CloudPlane&& next, const Eigen::Vector3d& sensor) {
  for (CloudPlane& p : planes) {
    const double range = (next.moments.mean() - sensor).norm();
    const double limit = sigma_at(std::max(range, (p.moments.mean() - sensor).norm()));
    if (angle_between(p.plane, next.plane) > 3 * kDegree) continue;
    if (std::abs(p.plane.signed_distance(next.moments.mean())) > limit ||
        std::abs(next.plane.signed_distance(p.moments.mean())) > 2 * limit) {
      continue;
    }
    p.moments.merge(next.moments);
    p.points.insert(p.points.end(), next.points.begin(), next.points.end());
    if (const auto fit = p.moments.fit_plane(sensor, 1.0)) p.plane = fit->plane;
    return;
  }
  planes.push_back(std::move(next));
}

ExtractedPlane extracted(const CloudPlane& p, const SE3& T_sensor_body) {
  ExtractedPlane out;
  out.plane_camera = T_sensor_body * p.plane;
  out.moments_camera = p.moments.transformed(T_sensor_body);
  out.centroid_camera = out.plane_camera.project(out.moments_camera.mean());
  out.pixels = static_cast<std::int64_t>(p.points.size());
  out.rms_px = std::sqrt(p.moments.cost(p.plane) / p.moments.weight());
  out.floor = {0.002, 0.002};
  const SE3 T_body_plane = plane_frame(p.plane, p.moments.mean());
  const SE3 T_plane_body = T_body_plane.inverse();
  std::vector<Eigen::Vector2d> flat;
  for (const auto& x : p.points) flat.push_back((T_plane_body * x).head<2>());
  if (const auto hull = Polygon::convex_hull(flat)) {
    out.area = hull->area();
    const Polygon outline = hull->simplified(0.02);
    for (const auto& v : outline.vertices()) {
      out.outline_camera.push_back(T_sensor_body *
                                   (T_body_plane * Eigen::Vector3d(v.x(), v.y(), 0)));
    }
  }
  return out;
}

Surfel surfel_of(const Moments& moments, const Eigen::Vector3d& normal, double side, int plane) {
  Surfel s;
  s.center = moments.mean();
  s.normal = normal;
  s.radius = side / std::sqrt(M_PI);
  s.covariance.diagonal() << 1e-4, 1e-4, 1 / moments.weight() + 4e-6;
  s.parent_plane = plane;
  return s;
}

// Evidence squares of the floor's points: the cloud's surface, patches and surfels.
void lay_floor(const std::vector<CloudPlane>& planes, const SE3& T_prior,
               const FloorOptions& options, FloorResult& result) {
  result.surface = FloorSurface({0, -0.5 * options.roi_m[1]}, options.cell_m,
                                static_cast<int>(std::ceil(options.roi_m[0] / options.cell_m)),
                                static_cast<int>(std::ceil(options.roi_m[1] / options.cell_m)));
  const SE3 T_body_prior = result.T_body_camera * T_prior.inverse();
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const ExtractedPlane& plane = result.planes[k];
    const bool floor =
        plane.kind == PlaneKind::kDominantFloor || plane.kind == PlaneKind::kSubDominant;
    const auto index = static_cast<std::int16_t>(result.surface.planes().size());
    const Eigen::Vector3d& n = plane.plane_body.normal();
    if (floor)
      result.surface.add_plane({-n.x() / n.z(), -n.y() / n.z(), plane.plane_body.rho() / n.z()});
    std::map<std::pair<int, int>, Moments> patches;
    for (const Eigen::Vector3d& point : planes[k].points) {
      const Eigen::Vector3d p = T_body_prior * point;
      const auto cell = result.surface.cell_of(p.head<2>());
      if (!cell) continue;
      GroundCell& c = result.surface.at(cell->first, cell->second);
      const float z = static_cast<float>(p.z());
      c.top = std::isnan(c.top) ? z : std::max(c.top, z);
      if (!floor) continue;
      c.plane = index;
      const float count = static_cast<float>(++c.pixels);
      c.height = count == 1 ? z : c.height + (z - c.height) / count;
      patches[{to_cell(p.x() / options.surfel_m), to_cell(p.y() / options.surfel_m)}].add(
          p, 1 / std::pow(sigma_at(p.norm()), 2));
    }
    for (const auto& [key, moments] : patches) {
      if (moments.count() < 8) continue;
      result.floor_patches.push_back(
          {moments.transformed(result.T_body_camera.inverse()), plane.floor});
      result.surfels_body.push_back(surfel_of(moments, n, options.surfel_m, static_cast<int>(k)));
    }
  }
}

}  // namespace

void CloudPlanes::process(const CloudFrame& frame, FloorJudge& judge, FloorResult& result) {
  const auto start = std::chrono::steady_clock::now();
  const SE3 T_prior = judge.prior(frame.T_body_sensor).T_body_camera;
  const Eigen::Vector3d sensor = T_prior.translation();
  const Cloud::Ptr inside = crop(frame, T_prior, options_);
  std::vector<Cloud::Ptr> parts(static_cast<std::size_t>(sections_.count()));
  for (auto& part : parts) part.reset(new Cloud);
  for (const auto& p : *inside) {
    const int s = sections_.section_of(p.getVector3fMap().cast<double>());
    if (s >= 0) parts[static_cast<std::size_t>(s)]->push_back(p);
  }
  std::vector<CloudPlane> planes;
  for (const int s : sections_.by_priority()) {
    const double spent =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (options_.time_budget_ms > 0 && spent > options_.time_budget_ms) {
      result.skipped_sections.push_back(sections_.coordinates(s));
      continue;
    }
    const Cloud::Ptr clean =
        without_outliers(parts[static_cast<std::size_t>(s)], options_.outlier_alpha);
    for (CloudPlane& p : recurse(clean, sensor, options_)) merge_into(planes, std::move(p), sensor);
  }
  std::stable_sort(planes.begin(), planes.end(), [](const CloudPlane& a, const CloudPlane& b) {
    return a.points.size() > b.points.size();
  });
  for (const CloudPlane& p : planes) result.planes.push_back(extracted(p, T_prior.inverse()));
  judge.judge(frame.T_body_sensor, static_cast<double>(frame.points_sensor.size()), result);
  if (inside->size() < 60) {
    result.status = FloorStatus::kNoData;
    result.reason = "hardly any point in the region of interest";
  }
  if (result.dominant >= 0) lay_floor(planes, T_prior, options_, result);
  result.times.planes_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace lamina
