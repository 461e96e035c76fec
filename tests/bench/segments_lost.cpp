// One value of odometry is lost while a scanner looks at the ground: error against iteration.
//   segments_lost [SCENE...]      default: lost_altitude lost_roll
// Three good poses, then odometry leaps (50 m of height, 22 degrees of roll). The fault is found by
// the front-end, as in the program; one batch then starts from dead reckoning.
#include <cmath>
#include <cstdio>

#include <lamina/backend/association/plane_evidence.hpp>
#include <lamina/backend/refine/refiner.hpp>
#include <lamina/frontend/segments/segment_frontend.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sensors/odometry.hpp>
#include <lamina/sim/sim_recording.hpp>

using namespace lamina;

namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kIterations = 12;

struct Experiment {
  Graph graph;
  std::vector<SE3> truth;
  std::size_t fault = 0;  // index of the first pose after it; 0: not noticed
};

// Odometry that leapt is believed in no measure of the way that it leapt.
Matrix6d suspected(Matrix6d covariance, const Vector6d& leap_scanner, const SE3& T_body_lidar) {
  const Vector6d leap = T_body_lidar.adjoint() * leap_scanner;
  covariance.topLeftCorner<3, 3>() += leap.head<3>() * leap.head<3>().transpose();
  covariance.bottomRightCorner<3, 3>() += leap.tail<3>() * leap.tail<3>().transpose();
  return covariance;
}

Experiment run(const std::string& scene, std::uint64_t seed) {
  sim::Simulation simulation(sim::make_scene(scene), seed);
  const OdometryModel model = simulation.calibration().odometry;
  TrackingOptions tracking;
  tracking.odometry = model;
  tracking.min_observations = 1;  // as the program sets it for scanners that are not level
  SegmentFrontend frontend({}, tracking);
  Experiment e;
  std::vector<std::pair<KeyframeId, Moments>> views;
  Moments good;
  SE3 T_odom_body, T_odom_last;
  while (const std::optional<Measurement> m = simulation.next()) {
    if (const Odometry* odometry = std::get_if<Odometry>(&*m)) T_odom_body = odometry->T_odom_body;
    const LaserScan* scan = std::get_if<LaserScan>(&*m);
    if (!scan) continue;
    const KeyframeId pose = e.graph.add_keyframe(scan->stamp, T_odom_body);
    e.truth.push_back(simulation.pose_at(scan->stamp));
    std::optional<SE3> motion;
    if (e.truth.size() > 1) motion = T_odom_last.inverse() * T_odom_body;
    T_odom_last = T_odom_body;
    const Observations seen = frontend.process(*scan, motion);
    if (motion) {
      Matrix6d covariance = increment_covariance(model, *motion);
      if (const auto& leap = frontend.tracker().leap()) {
        covariance = suspected(covariance, *leap, scan->lidar.T_body_lidar);
        if (e.fault == 0) e.fault = e.truth.size() - 1;
      }
      const Matrix6d S = covariance.llt().matrixL().solve(Matrix6d::Identity());
      const KeyframeId before = e.graph.keyframes[e.graph.keyframes.size() - 2].id;
      e.graph.odometry.push_back({before, pose, *motion, S});
    }
    for (const PlaneEvidence& evidence : make_evidence(seen)) {
      views.emplace_back(
          pose, evidence.moments_body.discounted(evidence.plane_body.normal(), evidence.floor));
      if (e.fault == 0) good.merge(views.back().second.transformed(T_odom_body));
    }
  }
  e.graph.keyframes.front().fixed = true;
  // The plane as the poses before the fault know it.
  const auto fit = good.fit_plane(e.truth.front().translation(), 1.0);
  if (!fit) throw Error(scene + ": found no ground before the fault");
  const PlaneId ground = e.graph.add_plane(PlaneLandmark::at(fit->plane, good.mean()));
  for (const auto& [pose, moments] : views) {
    e.graph.plane_moments.push_back({pose, ground, moments, ExtrinsicsId::kNone, 1.0});
  }
  return e;
}

void report(const std::string& scene, std::uint64_t seed) {
  const Experiment e = run(scene, seed);
  std::printf("%s, seed %d: %s\n", scene.c_str(), static_cast<int>(seed),
              e.fault > 0 ? "fault noticed" : "fault NOT noticed");
  if (e.fault == 0) return;
  std::printf("  iteration   height error m   roll error deg   pitch error deg   (fourth pose)\n");
  for (int n = 0; n <= kIterations; ++n) {
    Graph graph = e.graph;
    if (n > 0) {
      RefineOptions options;
      options.robust = false;
      options.minimizer.max_iterations = n;
      const RefineResult result = refine(graph, options);
      if (result.iterations < n) break;
    }
    const SE3 off = e.truth[e.fault].inverse() * graph.keyframes[e.fault].T_map_body;
    const double height =
        (graph.keyframes[e.fault].T_map_body.translation() - e.truth[e.fault].translation()).z();
    const Eigen::Vector3d turn = off.so3().log();
    std::printf("  %9d   %14.4f   %14.4f   %15.4f\n", n, height, turn.x() / kDegree,
                turn.y() / kDegree);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> scenes(argv + 1, argv + argc);
  if (scenes.empty()) scenes = {"lost_altitude", "lost_roll"};
  try {
    for (const std::string& scene : scenes) {
      for (const std::uint64_t seed : {1, 2, 3}) report(scene, seed);
    }
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
