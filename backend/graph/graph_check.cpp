// What is wrong with a Graph: broken references, numbers that are not finite, ids out of order.
#include <string>

#include <lamina/backend/graph/graph.hpp>

namespace lamina {
namespace {

bool finite(const SE3& T) {
  return T.translation().allFinite() && T.so3().quaternion().coeffs().allFinite();
}
bool finite(const Plane& plane) { return plane.normal().allFinite() && std::isfinite(plane.rho()); }
bool finite(const Moments& moments) {
  return std::isfinite(moments.weight()) && moments.mean().allFinite() &&
         moments.scatter().allFinite();
}

/// Collects lines "TYPE INDEX: WHAT".
class Findings {
 public:
  explicit Findings(const Graph& graph) : graph_(graph) {}
  template <class Id>
  void needs(const char* what, std::size_t index, Id id) {
    if (graph_.find(id) == nullptr) {
      say(what, index, "refers to missing id " + std::to_string(static_cast<std::int64_t>(id)));
    }
  }
  void needs_finite(const char* what, std::size_t index, bool is_finite) {
    if (!is_finite) say(what, index, "holds a number that is not finite");
  }
  void say(const char* what, std::size_t index, const std::string& text) {
    lines.push_back(std::string(what) + " " + std::to_string(index) + ": " + text);
  }
  std::vector<std::string> lines;

 private:
  const Graph& graph_;
};

template <class States>
void check_order(const char* what, const States& states, std::int64_t next, Findings& findings) {
  // Beyond all use, and joining maps adds such numbers.
  constexpr std::int64_t kMostIds = std::int64_t{1} << 48;
  if (next < 0 || next > kMostIds) findings.say(what, 0, "next id beyond all use");
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (i > 0 && !(states[i - 1].id < states[i].id)) findings.say(what, i, "id does not rise");
    if (static_cast<std::int64_t>(states[i].id) >= next) findings.say(what, i, "id not yet given");
  }
}

template <class Factors>
void check_pairs(const char* what, const Factors& factors, Findings& findings) {
  for (std::size_t i = 0; i < factors.size(); ++i) {
    findings.needs(what, i, factors[i].from);
    findings.needs(what, i, factors[i].to);
    if (factors[i].from == factors[i].to) findings.say(what, i, "joins a keyframe to itself");
    findings.needs_finite(what, i,
                          finite(factors[i].T_from_to) && factors[i].sqrt_information.allFinite());
    if constexpr (requires { factors[i].extrinsics; }) {
      if (factors[i].extrinsics != ExtrinsicsId::kNone)
        findings.needs(what, i, factors[i].extrinsics);
    }
  }
}

void check_states(const Graph& graph, Findings& findings) {
  check_order("keyframe", graph.keyframes, graph.next_keyframe, findings);
  check_order("plane", graph.planes, graph.next_plane, findings);
  check_order("surfel", graph.surfels, graph.next_surfel, findings);
  check_order("extrinsics", graph.extrinsics, graph.next_extrinsics, findings);
  check_order("custom_state", graph.custom_states, graph.next_custom_state, findings);
  for (std::size_t i = 0; i < graph.custom_states.size(); ++i) {
    const std::string problem = problem_of(graph.custom_states[i]);
    if (!problem.empty()) findings.say("custom_state", i, problem);
  }
  for (std::size_t i = 0; i < graph.keyframes.size(); ++i) {
    findings.needs_finite("keyframe", i, finite(graph.keyframes[i].T_map_body));
  }
  for (std::size_t i = 0; i < graph.planes.size(); ++i) {
    const auto& plane = graph.planes[i];
    findings.needs_finite("plane", i, finite(plane.plane_anchor) && plane.anchor_map.allFinite());
    if (plane.merged_into != PlaneId::kNone) findings.needs("plane", i, plane.merged_into);
  }
  for (std::size_t i = 0; i < graph.extrinsics.size(); ++i) {
    const Extrinsics& e = graph.extrinsics[i];
    findings.needs_finite("extrinsics", i, finite(e.T_body_sensor) && finite(e.state));
    findings.needs_finite("extrinsics", i, finite(e.prior) && e.prior_sigma.allFinite());
    if (!(e.prior_sigma.minCoeff() > 0)) findings.say("extrinsics", i, "prior without a sigma");
  }
  for (std::size_t i = 0; i < graph.surfels.size(); ++i) {
    findings.needs("surfel", i, graph.surfels[i].anchor);
    findings.needs_finite("surfel", i, graph.surfels[i].state.allFinite());
  }
}

void check_marginals(const Graph& graph, Findings& findings) {
  for (std::size_t i = 0; i < graph.marginal_priors.size(); ++i) {
    const MarginalPrior& f = graph.marginal_priors[i];
    for (const auto id : f.keyframes) findings.needs("marginal_prior", i, id);
    for (const auto id : f.planes) findings.needs("marginal_prior", i, id);
    for (const auto id : f.surfels) findings.needs("marginal_prior", i, id);
    if (f.poses_linear.size() != f.keyframes.size() || f.planes_linear.size() != f.planes.size() ||
        f.surfels_linear.size() != f.surfels.size() || f.sqrt_information.cols() != f.dimension() ||
        f.sqrt_information.rows() != f.residual.size()) {
      findings.say("marginal_prior", i, "sizes do not agree");
    }
    findings.needs_finite("marginal_prior", i,
                          f.sqrt_information.allFinite() && f.residual.allFinite());
  }
}

void check_observations(const Graph& graph, Findings& findings) {
  for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
    const auto& f = graph.plane_moments[i];
    findings.needs("plane_moments", i, f.keyframe);
    findings.needs("plane_moments", i, f.plane);
    if (f.extrinsics != ExtrinsicsId::kNone) findings.needs("plane_moments", i, f.extrinsics);
    findings.needs_finite("plane_moments", i, finite(f.moments_body));
    for (const SensorMoments& part : f.by_sensor) {
      if (part.extrinsics != ExtrinsicsId::kNone)
        findings.needs("plane_moments", i, part.extrinsics);
      findings.needs_finite("plane_moments", i, finite(part.moments_body));
    }
  }
  for (std::size_t i = 0; i < graph.segments.size(); ++i) {
    const auto& f = graph.segments[i];
    findings.needs("segment", i, f.keyframe);
    findings.needs("segment", i, f.plane);
    findings.needs_finite(
        "segment", i,
        f.start_body.allFinite() && f.end_body.allFinite() && f.sqrt_information.allFinite());
  }
  for (std::size_t i = 0; i < graph.surfel_moments.size(); ++i) {
    findings.needs("surfel_moments", i, graph.surfel_moments[i].keyframe);
    findings.needs("surfel_moments", i, graph.surfel_moments[i].surfel);
    findings.needs_finite("surfel_moments", i, finite(graph.surfel_moments[i].moments_body));
  }
  for (std::size_t i = 0; i < graph.surfel_parents.size(); ++i) {
    findings.needs("surfel_parent", i, graph.surfel_parents[i].surfel);
    findings.needs("surfel_parent", i, graph.surfel_parents[i].plane);
  }
}

}  // namespace

std::vector<std::string> Graph::problems() const {
  Findings findings(*this);
  check_states(*this, findings);
  check_pairs("odometry", odometry, findings);
  check_pairs("planar_odometry", planar_odometry, findings);
  check_pairs("loop", loops, findings);
  for (std::size_t i = 0; i < priors.size(); ++i) {
    findings.needs("prior", i, priors[i].keyframe);
    findings.needs_finite("prior", i, finite(priors[i].T_map_body));
  }
  for (std::size_t i = 0; i < gravity.size(); ++i) {
    findings.needs("gravity", i, gravity[i].keyframe);
    findings.needs_finite("gravity", i, gravity[i].up_body.allFinite());
  }
  check_observations(*this, findings);
  check_marginals(*this, findings);
  for (std::size_t i = 0; i < custom.size(); ++i) {
    const std::string problem = problem_of(custom[i], *this);
    if (!problem.empty()) findings.say("custom factor", i, "'" + custom[i].kind + "' " + problem);
  }
  return findings.lines;
}

}  // namespace lamina
