// Feeds a benchmark problem to the window pose by pose.
#include <lamina/pipeline/evaluation/window_plane_graph.hpp>

#include <chrono>

namespace lamina {
namespace {

struct Known {
  Plane plane_anchor;
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();
  std::optional<Eigen::Matrix3d> covariance;
  bool started = false;
};

// The first pose is held: 0.1 mm and 0.1 mrad are nothing beside one step of odometry.
constexpr double kHeldSigma = 1e-4;

class Runner {
 public:
  Runner(const PlaneGraph& problem, const WindowOptions& options, bool with_covariance)
      : problem_(problem), window_(options), with_covariance_(with_covariance) {
    const auto poses = problem.initial_map_body.size();
    odometry_to_.resize(poses);
    seen_from_.resize(poses);
    known_.resize(static_cast<std::size_t>(problem.plane_count));
    for (const auto& o : problem.odometry) {
      odometry_to_[static_cast<std::size_t>(std::max(o.from, o.to))].push_back(&o);
    }
    for (const auto& o : problem.observations) {
      seen_from_[static_cast<std::size_t>(o.pose)].push_back(&o);
    }
    run_.T_map_body.resize(poses);
    sqrt_information_.setZero();
    sqrt_information_.diagonal() << Eigen::Vector3d::Constant(1 / problem.sigma_translation),
        Eigen::Vector3d::Constant(1 / problem.sigma_rotation);
  }

  WindowRun run() {
    for (std::size_t i = 0; i < run_.T_map_body.size(); ++i) {
      const auto begin = std::chrono::steady_clock::now();
      step(i);
      const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - begin;
      run_.step_ms.push_back(ms.count());
    }
    for (const KeyframeId id : window_.keyframes()) {
      run_.T_map_body[static_cast<std::size_t>(id)] = window_.pose(id);
    }
    return std::move(run_);
  }

 private:
  void step(std::size_t i) {
    const auto id = static_cast<KeyframeId>(i);
    window_.add_keyframe(id, Timestamp::from_nanoseconds(static_cast<std::int64_t>(i)), start(i));
    if (i == 0) {
      window_.add(PriorFactor{id, window_.pose(id), Matrix6d::Identity() / kHeldSigma});
    }
    for (const auto* o : odometry_to_[i]) {
      window_.add(OdometryFactor{static_cast<KeyframeId>(o->from), static_cast<KeyframeId>(o->to),
                                 o->T_from_to, sqrt_information_});
    }
    for (const auto* o : seen_from_[i]) observe(id, *o);
    const WindowReport report = window_.solve();
    run_.iterations += report.iterations;
    run_.finite = run_.finite && report.finite;
    run_.T_map_newest.push_back(window_.pose(id));
    if (with_covariance_ && report.finite) {
      run_.newest_covariance.push_back(window_.newest_covariance());
    }
    const WindowDepartures gone = window_.marginalize();
    for (const auto& pose : gone.poses) {
      run_.T_map_body[static_cast<std::size_t>(pose.id)] = pose.T_map_body;
    }
    for (const auto& plane : gone.planes) {
      auto& known = known_[static_cast<std::size_t>(plane.id)];
      known.plane_anchor = plane.plane_anchor;
      known.covariance = plane.covariance;
      if (with_covariance_) {
        run_.departed.push_back(
            {static_cast<int>(plane.id), known.anchor, plane.plane_anchor, plane.covariance});
      }
    }
  }

  // Chained odometry from the pose before, the file's guess where there is none.
  SE3 start(std::size_t i) const {
    for (const auto* o : odometry_to_[i]) {
      const bool forward = static_cast<std::size_t>(o->to) == i;
      const auto other = static_cast<KeyframeId>(forward ? o->from : o->to);
      if (!window_.contains(other)) continue;
      return window_.pose(other) * (forward ? o->T_from_to : o->T_from_to.inverse());
    }
    return problem_.initial_map_body[i];
  }

  void observe(KeyframeId id, const PlaneGraph::Observation& o) {
    const double information = 1 / (problem_.sigma_point * problem_.sigma_point);
    const Moments weighted = o.moments_body.scaled(information);
    const auto fit = weighted.fit_plane(Eigen::Vector3d::Zero(), 1.0);
    if (!fit) return;
    const auto plane_id = static_cast<PlaneId>(o.plane);
    auto& known = known_[static_cast<std::size_t>(o.plane)];
    if (!window_.contains(plane_id)) {
      if (!known.started) {
        const SE3 T = window_.pose(id);
        known.anchor = T * fit->plane.project(weighted.mean());
        known.plane_anchor = (T * fit->plane).about(known.anchor);
        known.started = true;
      }
      window_.add_plane(plane_id, known.plane_anchor, known.anchor, known.covariance);
    }
    window_.add(PlaneMomentsFactor{id, plane_id,
                                   weighted.discounted(fit->plane.normal(), NoiseFloor()),
                                   ExtrinsicsId::kNone, 1.0});
  }

  const PlaneGraph& problem_;
  SlidingWindow window_;
  bool with_covariance_;
  Matrix6d sqrt_information_;
  std::vector<std::vector<const PlaneGraph::Odometry*>> odometry_to_;
  std::vector<std::vector<const PlaneGraph::Observation*>> seen_from_;
  std::vector<Known> known_;
  WindowRun run_;
};

}  // namespace

WindowRun run_window_on_plane_graph(const PlaneGraph& problem, const WindowOptions& options,
                                    bool with_covariance) {
  return Runner(problem, options, with_covariance).run();
}

}  // namespace lamina
