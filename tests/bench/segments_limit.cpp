// How well planes can be known from a scanner's scans at all: one batch over a simulated scene with
// the true associations and the odometry noise the scene states, against which a map is judged.
//   segments_limit [SCENE [SEEDS [KEY=VALUE...]]]      default: flyover 5; keys: docs/simulator.md
//   segments_limit SCENE SEEDS --fixes FILE [KEY=VALUE...]
// --fixes: with positions on the path besides, the same for every seed, as examples/gps_factor has
// them: "stamp x y z sigma" (scripts/fixes).
#include <ceres/autodiff_cost_function.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numeric>

#include <lamina/backend/association/plane_evidence.hpp>
#include <lamina/backend/refine/plane_refit.hpp>
#include <lamina/backend/refine/refiner.hpp>
#include <lamina/frontend/segments/segment_frontend.hpp>
#include <lamina/models/error.hpp>
#include <lamina/sensors/odometry.hpp>
#include <lamina/sim/sim_recording.hpp>

using namespace lamina;

namespace {

constexpr double kDegree = M_PI / 180;

struct Setup {
  const char* name;
  double surface_sigma_m, surface_sigma_deg;  // what walls are allowed to be off a plane
  bool from_odometry;                         // start: dead reckoning, or the truth
  bool robust;                                // observations may be doubted
};

// The mapper's own allowances for walls that are no planes stand in AssociationOptions.
const Setup kSetups[] = {
    {"sensor noise alone, from the truth", 0, 0, false, false},
    {"sensor noise alone, from dead reckoning", 0, 0, true, false},
    {"the same, observations doubted", 0, 0, true, true},
    {"the mapper's surface noise, from dead reckoning", 0.004, 0.2, true, false},
    {"the same, observations doubted", 0.004, 0.2, true, true}};

struct Errors {
  double ate = 0;
  std::vector<double> rho, angle;
  int iterations = 0;
  bool converged = false;
  double misfit = 0;         // chi-squared of the views over their degrees of freedom
  std::size_t rejected = 0;  // views
};

struct View {
  std::size_t pose;
  int plane;
  PlaneEvidence evidence;
};

struct Fix {
  double seconds = 0, sigma = 1;
  Eigen::Vector3d position_map;
  template <class T>
  bool operator()(const T* pose, T* r) const {
    for (int i = 0; i < 3; ++i) r[i] = (pose[i] - position_map(i)) / sigma;
    return true;
  }
};

std::vector<Fix> read_fixes(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw Error(file + ": cannot be read");
  std::vector<Fix> fixes;
  for (Fix f; in >> f.seconds >> f.position_map.x() >> f.position_map.y() >> f.position_map.z() >>
              f.sigma;) {
    fixes.push_back(f);
  }
  return fixes;
}

struct Data {
  std::vector<Timestamp> stamps;
  std::vector<Fix> fixes;
  std::vector<SE3> truth, dead_reckoning;
  std::vector<Matrix6d> increments;  // covariance of the motion to pose i
  std::vector<View> views;
  std::vector<Plane> planes;
};

// The plane that nine of ten beams of a segment hit; -1 for none.
int plane_of(const ScanSegment& s, const std::vector<int>& planes) {
  std::map<int, int> votes;
  const int n = static_cast<int>(planes.size());
  const int span = (s.last_beam - s.first_beam + n) % n;
  for (int i = 0; i <= span; ++i) ++votes[planes[static_cast<std::size_t>((s.first_beam + i) % n)]];
  for (const auto& [plane, count] : votes) {
    if (count >= 0.9 * (span + 1)) return plane;
  }
  return -1;
}

Data measure(const std::string& scene, const sim::Parameters& parameters, std::uint64_t seed) {
  sim::World world = sim::make_scene(scene, parameters);
  world.rig.depth.reset();
  world.rig.stereo.reset();
  sim::Simulation simulation(std::move(world), seed);
  Data data;
  for (const sim::ScenePlane& plane : simulation.world().scene.planes()) {
    data.planes.push_back(plane.plane_map);
  }
  SegmentExtractor extractor;
  // As odometry truly errs, not as the robot is told: the best weights there are.
  const sim::OdometryErrors& errors = simulation.world().rig.odometry.value().errors;
  OdometryModel model = simulation.calibration().odometry;
  model.sigma_translation = errors.sigma_translation;
  model.sigma_rotation = errors.sigma_rotation;
  model.sigma_rotation_turn = errors.sigma_rotation_turn;
  SE3 T_odom_body, T_odom_last;
  bool moved = false;
  while (const std::optional<Measurement> m = simulation.next()) {
    if (const Odometry* odometry = std::get_if<Odometry>(&*m)) T_odom_body = odometry->T_odom_body;
    const LaserScan* scan = std::get_if<LaserScan>(&*m);
    if (!scan) continue;
    std::vector<int> planes;
    for (const std::int32_t s : simulation.scan_truth().surfaces) {
      planes.push_back(s < 0 ? -1 : simulation.caster().plane_of(s));
    }
    if (moved) {
      data.increments.push_back(increment_covariance(model, T_odom_last.inverse() * T_odom_body));
    } else {
      data.increments.push_back(Matrix6d::Identity());
    }
    moved = true;
    T_odom_last = T_odom_body;
    data.stamps.push_back(scan->stamp);
    data.truth.push_back(simulation.pose_at(scan->stamp));
    data.dead_reckoning.push_back(T_odom_body);
    for (const ScanSegment& segment : extractor.extract(*scan).segments) {
      const int plane = plane_of(segment, planes);
      if (plane < 0) continue;
      const SegmentObservation seen{segment, noise_floor(segment, scan->lidar.noise), 0};
      data.views.push_back(
          {data.truth.size() - 1, plane, make_evidence(seen, scan->lidar.T_body_lidar)});
    }
  }
  return data;
}

// Each on the scan's pose that is nearest in time, within 50 ms.
void add_fixes(const Data& data, Graph& graph) {
  for (const Fix& fix : data.fixes) {
    std::size_t nearest = 0;
    const auto apart = [&](std::size_t i) {
      return std::abs(data.stamps[i] - Timestamp::from_seconds(fix.seconds));
    };
    for (std::size_t i = 0; i < data.stamps.size(); ++i) {
      if (apart(i) < apart(nearest)) nearest = i;
    }
    if (apart(nearest) > 0.05) continue;
    CustomFactor factor;
    factor.kind = "gps";
    factor.states = {graph.keyframes[nearest].id};
    factor.cost = std::make_shared<ceres::AutoDiffCostFunction<Fix, 3, 7>>(new Fix(fix));
    graph.custom.push_back(std::move(factor));
  }
}

Graph build(const Data& data, const Setup& setup, std::map<int, PlaneId>& ids) {
  Graph graph;
  std::vector<KeyframeId> poses;
  for (std::size_t i = 0; i < data.truth.size(); ++i) {
    const SE3& T = setup.from_odometry ? data.dead_reckoning[i] : data.truth[i];
    poses.push_back(graph.add_keyframe(Timestamp::from_seconds(double(i)), T));
    if (i == 0) continue;
    const Matrix6d S = data.increments[i].llt().matrixL().solve(Matrix6d::Identity());
    graph.odometry.push_back(
        {poses[i - 1], poses[i], data.dead_reckoning[i - 1].inverse() * data.dead_reckoning[i], S});
  }
  graph.at(poses.front()).fixed = true;
  add_fixes(data, graph);
  std::map<int, Moments> all;
  std::vector<Moments> moments;
  for (const View& view : data.views) {
    NoiseFloor floor = view.evidence.floor;
    floor.sigma_rho = std::hypot(floor.sigma_rho, setup.surface_sigma_m);
    floor.sigma_tilt = std::hypot(floor.sigma_tilt, setup.surface_sigma_deg * kDegree);
    moments.push_back(
        view.evidence.moments_body.discounted(view.evidence.plane_body.normal(), floor));
    all[view.plane].merge(moments.back().transformed(graph.at(poses[view.pose]).T_map_body));
  }
  for (const auto& [plane, sum] : all) {
    ids[plane] = graph.add_plane(
        PlaneLandmark::at(data.planes[static_cast<std::size_t>(plane)], sum.mean()));
  }
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    const View& view = data.views[i];
    graph.plane_moments.push_back(
        {poses[view.pose], ids.at(view.plane), moments[i], ExtrinsicsId::kNone, 1.0});
  }
  if (setup.from_odometry) fit_planes_to_evidence(graph);
  return graph;
}

// The rotation and offset that lay the poses on the truth, as `lamina evaluate` does it.
SE3 aligned(const Graph& graph, const std::vector<SE3>& truth) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Eigen::Vector4d q =
        (truth[i].so3() * graph.keyframes[i].T_map_body.so3().inverse()).quaternion().coeffs();
    sum += q.w() < 0 ? Eigen::Vector4d(-q) : q;
  }
  const SO3 R{Eigen::Quaterniond(sum)};
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    t += (truth[i].translation() - R * graph.keyframes[i].T_map_body.translation()) /
         static_cast<double>(truth.size());
  }
  return SE3(R, t);
}

Errors solve(const Data& data, const Setup& setup) {
  std::map<int, PlaneId> ids;
  Graph graph = build(data, setup, ids);
  RefineOptions options;
  options.robust = setup.robust;
  const RefineResult result = refine(graph, options);
  Errors errors;
  errors.iterations = result.iterations;
  errors.converged = result.status == SolveStatus::kConverged;
  errors.rejected = result.rejected.size();
  for (const CostChange& cost : result.costs) {
    if (cost.type != FactorType::kPlaneMoments) continue;
    errors.misfit = cost.after / (2 * static_cast<double>(cost.factors - errors.rejected));
  }
  const SE3 T_truth_map = aligned(graph, data.truth);
  for (std::size_t i = 0; i < data.truth.size(); ++i) {
    errors.ate +=
        (T_truth_map * graph.keyframes[i].T_map_body.translation() - data.truth[i].translation())
            .squaredNorm() /
        static_cast<double>(data.truth.size());
  }
  errors.ate = std::sqrt(errors.ate);
  for (const auto& [plane, id] : ids) {
    Moments seen;
    int views = 0;
    for (const PlaneMomentsFactor& f : graph.plane_moments) {
      if (f.plane != id) continue;
      seen.merge(f.moments_body.transformed(T_truth_map * graph.at(f.keyframe).T_map_body));
      ++views;
    }
    if (views < 3) continue;
    const Plane found = T_truth_map * graph.at(id).plane_map();
    const Plane& truth = data.planes[static_cast<std::size_t>(plane)];
    const double turn = angle_between(found, truth);
    errors.rho.push_back(std::abs(truth.signed_distance(found.project(seen.mean()))));
    errors.angle.push_back(std::min(turn, M_PI - turn) / kDegree);
  }
  return errors;
}

double mean(const std::vector<double>& v) {
  return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
}

}  // namespace

int main(int argc, char** argv) {
  const std::string scene = argc > 1 ? argv[1] : "flyover";
  const int seeds = argc > 2 ? std::atoi(argv[2]) : 5;
  sim::Parameters parameters;
  std::string fixes;
  for (int i = 3; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--fixes" && i + 1 < argc) {
      fixes = argv[++i];
      continue;
    }
    const std::size_t split = std::min(word.find('='), word.size() - 1);
    parameters[word.substr(0, split)] = word.substr(split + 1);
  }
  try {
    std::printf("%s: a batch with true associations; poses aligned with the truth\n",
                scene.c_str());
    for (int seed = 1; seed <= seeds; ++seed) {
      Data data = measure(scene, parameters, static_cast<std::uint64_t>(seed));
      if (!fixes.empty()) data.fixes = read_fixes(fixes);
      for (const Setup& setup : kSetups) {
        const Errors e = solve(data, setup);
        std::printf(
            "seed %d  %-48s %2zu planes: distance mean %.4f max %.4f m, angle mean %.3f max %.3f "
            "degrees, ATE %.4f m, %s after %d, chi-squared %.2f, %zu rejected\n",
            seed, setup.name, e.rho.size(), mean(e.rho),
            *std::max_element(e.rho.begin(), e.rho.end()), mean(e.angle),
            *std::max_element(e.angle.begin(), e.angle.end()), e.ate,
            e.converged ? "converged" : "not converged", e.iterations, e.misfit, e.rejected);
      }
    }
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
