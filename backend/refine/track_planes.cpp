// Nameless planes for tracks, made from their first view.
#include <lamina/backend/refine/track_planes.hpp>

#include <algorithm>
#include <utility>
#include <vector>

#include <lamina/backend/refine/plane_refit.hpp>

namespace lamina {
namespace {

/// The plane of each track in a graph, made when it is first asked for.
class NamelessPlanes {
 public:
  explicit NamelessPlanes(const Tracks& tracks)
      : ids_(static_cast<std::size_t>(tracks.count), PlaneId::kNone) {}

  /// `view`: seen by a keyframe of `graph`.
  PlaneId of(int track, const PlaneMomentsFactor& view, Graph& graph) {
    PlaneId& id = ids_[static_cast<std::size_t>(track)];
    if (id != PlaneId::kNone) return id;
    PlaneLandmark plane;
    const SE3& T_map_body = graph.at(view.keyframe).T_map_body;
    plane.anchor_map = T_map_body * view.moments_body.mean();
    const auto fit = view.moments_body.fit_plane(Eigen::Vector3d::Zero(), 1.0);
    if (fit) plane.plane_anchor = (T_map_body * fit->plane).about(plane.anchor_map);
    id = graph.add_plane(plane);
    return id;
  }

 private:
  std::vector<PlaneId> ids_;
};

}  // namespace

void follow_tracks(Graph& graph, const Tracks& tracks, const RefineOptions& options) {
  Graph path = graph;
  path.planes.clear();
  path.plane_moments.clear();
  path.segments.clear();
  path.loops.clear();
  path.surfels.clear();
  path.surfel_moments.clear();
  path.surfel_parents.clear();
  path.marginal_priors.clear();
  std::erase_if(path.custom, [](const CustomFactor& f) { return f.may_be_wrong; });
  NamelessPlanes planes(tracks);
  for (std::size_t i = 0; i < graph.plane_moments.size(); ++i) {
    if (tracks.track[i] == Tracks::kNone) continue;
    PlaneMomentsFactor factor = graph.plane_moments[i];
    factor.plane = planes.of(tracks.track[i], factor, path);
    factor.weight = 1;
    path.plane_moments.push_back(factor);
  }
  fit_planes_to_evidence(path);
  const auto engine = make_engine(path, options.engine);
  MinimizerOptions minimizer = options.minimizer;
  minimizer.initial_damping = std::max(1e-10, minimizer.initial_damping);
  engine->minimize(minimizer);
  engine->write(path);
  graph.keyframes = std::move(path.keyframes);
  graph.extrinsics = std::move(path.extrinsics);
}

bool TrackViews::add(Graph& graph, const Tracks& tracks, double limit) const {
  const std::vector<PlaneId> names = names_of_tracks(graph, tracks, limit);
  NamelessPlanes nameless(tracks);
  for (std::size_t i = 0; i < factors_; ++i) {
    const int track = tracks.track[i];
    PlaneMomentsFactor factor = graph.plane_moments[i];
    if (track == Tracks::kNone || factor.weight >= 0.5) continue;
    PlaneId name = names[static_cast<std::size_t>(track)];
    if (name == factor.plane) continue;
    if (name == PlaneId::kNone) name = nameless.of(track, factor, graph);
    factor.plane = name;
    factor.weight = 1;
    graph.plane_moments.push_back(factor);
  }
  return graph.plane_moments.size() > factors_;
}

void TrackViews::remove(Graph& graph) const {
  graph.plane_moments.resize(factors_);
  graph.planes.resize(planes_);
  graph.next_plane = next_plane_;
}

}  // namespace lamina
