// Planes by RANSAC clustering of the accumulated cloud, beside ours: the comparison of figure 10 of
// the document on planes from a 2D lidar. The points are laid out along the path of our own map.
//   segments_ransac DATASET MAP [THRESHOLD_M...]      default: 0.01 0.1; MAP: a folder `lamina map`
//   wrote
#include <pcl/filters/extract_indices.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <lamina/io/map_files.hpp>
#include <lamina/models/error.hpp>
#include <lamina/models/polygon.hpp>
#include <lamina/models/trajectory.hpp>
#include <lamina/pipeline/evaluation/evaluation.hpp>
#include <lamina/pipeline/evaluation/plane_error.hpp>
#include <lamina/sensors/recording.hpp>
#include <lamina/sim/truth.hpp>

using namespace lamina;

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

// Enough to be a plane at all, and as much as may be left over.
constexpr std::size_t kLeastPoints = 100;
constexpr double kLeftOver = 0.02;
constexpr int kIterations = 500;

Cloud::Ptr accumulate(const std::string& dataset, const Trajectory& trajectory) {
  Cloud::Ptr cloud(new Cloud);
  const auto recording = open_recording(dataset);
  while (const std::optional<Measurement> m = recording->next()) {
    const LaserScan* scan = std::get_if<LaserScan>(&*m);
    if (!scan) continue;
    const std::optional<SE3> T_map_body = trajectory.at(scan->stamp);
    if (!T_map_body) continue;
    for (std::size_t i = 0; i < scan->size(); ++i) {
      if (!scan->valid(i)) continue;
      const Eigen::Vector2d p = scan->point(i);
      const Eigen::Vector3d x =
          *T_map_body * (scan->lidar.T_body_lidar * Eigen::Vector3d(p.x(), p.y(), 0));
      cloud->push_back({float(x.x()), float(x.y()), float(x.z())});
    }
  }
  return cloud;
}

MapPlane plane_of(const Cloud& cloud, const pcl::PointIndices& inliers,
                  const pcl::ModelCoefficients& model, std::int64_t id) {
  MapPlane plane;
  plane.id = id;
  plane.plane_map =
      Plane(Eigen::Vector3d(model.values[0], model.values[1], model.values[2]), -model.values[3]);
  for (const int i : inliers.indices) {
    plane.centroid_map += cloud[static_cast<std::size_t>(i)].getVector3fMap().cast<double>() /
                          static_cast<double>(inliers.indices.size());
  }
  const SE3 T_map_plane = plane_frame(plane.plane_map, plane.centroid_map);
  std::vector<Eigen::Vector2d> flat;
  for (const int i : inliers.indices) {
    const Eigen::Vector3d p = cloud[static_cast<std::size_t>(i)].getVector3fMap().cast<double>();
    flat.push_back((T_map_plane.inverse() * p).head<2>());
  }
  if (const auto hull = Polygon::convex_hull(flat)) {
    plane.area = hull->area();
    std::vector<Eigen::Vector3d> outline;
    for (const Eigen::Vector2d& p : hull->vertices()) {
      outline.push_back(T_map_plane * Eigen::Vector3d(p.x(), p.y(), 0));
    }
    plane.outlines_map.push_back(outline);
  }
  plane.covariance.setIdentity();
  return plane;
}

std::vector<MapPlane> cluster(Cloud::Ptr cloud, double threshold) {
  std::vector<MapPlane> planes;
  pcl::SACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setModelType(pcl::SACMODEL_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setOptimizeCoefficients(true);
  segmentation.setMaxIterations(kIterations);
  segmentation.setDistanceThreshold(threshold);
  pcl::ExtractIndices<pcl::PointXYZ> extract;
  const std::size_t all = cloud->size();
  constexpr std::size_t kMostPlanes = 300;
  while (cloud->size() > kLeftOver * static_cast<double>(all) && planes.size() < kMostPlanes) {
    pcl::PointIndices::Ptr inliers(new pcl::PointIndices);
    pcl::ModelCoefficients model;
    segmentation.setInputCloud(cloud);
    segmentation.segment(*inliers, model);
    if (inliers->indices.size() < kLeastPoints) break;
    planes.push_back(plane_of(*cloud, *inliers, model, static_cast<std::int64_t>(planes.size())));
    Cloud::Ptr rest(new Cloud);
    extract.setInputCloud(cloud);
    extract.setIndices(inliers);
    extract.setNegative(true);
    extract.filter(*rest);
    cloud = rest;
  }
  return planes;
}

void report(const char* name, const std::vector<MapPlane>& planes, const sim::Truth& truth,
            const SE3& T_truth_map, double seconds) {
  std::vector<ReferencePlane> reference;
  for (const sim::TruthPlane& p : truth.planes) {
    reference.push_back(
        {p.id, p.plane_map, p.outline_map, p.sightings >= 3 ? p.hits : std::int64_t{0}});
  }
  const PlaneErrors e = plane_errors(planes, reference, T_truth_map);
  std::printf(
      "%-22s %3zu planes: matched %zu, missed %zu, split %zu, merged %zu, spurious %zu; distance "
      "mean %.4f max %.3f m, angle mean %.3f max %.2f degrees",
      name, planes.size(), e.matches.size(), e.missed.size(), e.split.size(), e.merged.size(),
      e.spurious.size(), e.rho_mean_m, e.rho_max_m, e.angle_mean_deg, e.angle_max_deg);
  if (seconds > 0) std::printf("; %.1f s", seconds);
  std::printf("\n");
}

int run(const std::string& dataset, const std::string& map, const std::vector<double>& thresholds) {
  const auto truth = sim::read_truth(dataset);
  if (!truth) throw Error(dataset + ": found no truth.yaml, expected a simulated dataset");
  const Trajectory trajectory = Trajectory::read_tum(map + "/trajectory.txt");
  const SE3 T_truth_map =
      align_poses(trajectory, Trajectory::read_tum(dataset + "/groundtruth.txt"));
  const Cloud::Ptr cloud = accumulate(dataset, trajectory);
  std::printf("%s: %zu points\n", dataset.c_str(), cloud->size());
  report("ours", io::read_planes_json(map + "/planes.json"), *truth, T_truth_map, 0);
  for (const double threshold : thresholds) {
    const auto start = std::chrono::steady_clock::now();
    const std::vector<MapPlane> planes = cluster(cloud, threshold);
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    char name[32];
    std::snprintf(name, sizeof name, "RANSAC, %.0f mm", 1e3 * threshold);
    report(name, planes, *truth, T_truth_map, seconds);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: segments_ransac DATASET MAP [THRESHOLD_M...]\n");
    return 2;
  }
  std::vector<double> thresholds;
  for (int i = 3; i < argc; ++i) thresholds.push_back(std::atof(argv[i]));
  if (thresholds.empty()) thresholds = {0.01, 0.1};
  try {
    return run(argv[1], argv[2], thresholds);
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
